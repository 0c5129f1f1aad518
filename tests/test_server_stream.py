"""The WebSocket edge on a real server: handshake, order, sameness of the bits, timeouts, limits."""

import asyncio
import json
import re
import socket
from pathlib import Path

import httpx
import pytest
import websockets

from bodies import motion
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import Frame, SessionStart
from fervor.recordings.bvh import read_bvh
from fervor.recordings.recording import rig_poses
from live import PROTOCOL, Live, RawClient, bare, eventually, frames_of, score, score_request, talk

FRAMES = frames_of(motion(90))


async def test_the_protocol_offered_is_chosen(live: Live) -> None:
    async with talk(live, subprotocols=["something.else", PROTOCOL]) as stream:
        assert stream.socket.subprotocol == PROTOCOL
        assert (await stream.start())["type"] == "session.started"


async def test_a_client_that_offers_none_gets_json(live: Live) -> None:
    async with talk(live, subprotocols=None) as stream:
        assert stream.socket.subprotocol is None
        assert (await stream.start())["protocol"] == "fervor.v1"


async def test_unknown_protocols_are_refused_with_a_sentence(live: Live) -> None:
    with pytest.raises(websockets.InvalidStatus) as refused:
        async with talk(live, subprotocols=["fervor.v9.json", "mqtt"]):
            pass
    response = refused.value.response
    assert response.status_code == 400
    assert response.headers["content-type"] == "application/problem+json"
    assert b"subprotocol fervor.v9.json, mqtt is not known; expected fervor.v1.json" in response.body


def test_plain_http_is_asked_to_upgrade(http: httpx.Client) -> None:
    answer = http.get("/v1/stream")
    assert answer.status_code == 426
    assert answer.headers["upgrade"] == "websocket"


async def test_compression_is_off_and_nagle_too(live: Live) -> None:
    async with websockets.connect(live.stream, subprotocols=[PROTOCOL]) as offering:  # permessage-deflate
        assert not offering.response.headers.get("Sec-WebSocket-Extensions")
    assert live.bound.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


async def test_what_the_service_says_of_itself(live: Live) -> None:
    async with talk(live) as stream:
        started = await stream.start()
    assert started["model"]["sha256"] == live.service.model.sha256
    assert started["fingerprint"] == live.service.model.fingerprint
    assert started["limits"]["max_bodies"] == live.service.settings.max_bodies


async def test_every_frame_gets_its_estimate_in_order(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        estimates = await stream.follow(FRAMES)
    assert [estimate["seq"] for estimate in estimates] == list(range(len(FRAMES)))
    assert all(0 <= estimate["intensity"] <= 1 for estimate in estimates)


async def test_a_session_ends_when_all_is_answered(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start()
        for frame in FRAMES:
            await stream.send("frame", **frame)
        await stream.send("session.end")
        heard = [await stream.hear() for _ in range(len(FRAMES) + 1)]
        assert heard[-1]["type"] == "session.ended"
        assert heard[-1]["totals"]["estimates"] == len(FRAMES)
        assert await stream.closed() == (1000, "ended by the client")


async def test_pings_are_answered_in_both_ways(live: Live) -> None:
    async with talk(live) as stream:
        await stream.send("ping", id="1")
        assert await stream.hear() == {"type": "pong", "id": "1"}
        await (await stream.socket.ping())


# --- the same bits ----------------------------------------------------------------------------------------------------


async def test_frames_in_one_message_change_no_bit(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        one_by_one = await stream.follow(FRAMES)
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        await stream.send("frames", frames=FRAMES)
        together = await stream.hear()
    assert together["type"] == "estimates"
    assert together["estimates"] == one_by_one


async def test_real_motion_is_scored_as_it_is_streamed(live: Live, shared_data: Path) -> None:
    times, rotations, observed = rig_poses(read_bvh(shared_data / "100style" / "angry_reference.bvh"))
    frames = [
        {"seq": seq, "t": time, "q": pose, "mask": mask}
        for seq, (time, pose, mask) in enumerate(
            zip(times.tolist(), rotations.tolist(), observed.tolist(), strict=True)
        )
    ]
    async with talk(live) as stream:
        await stream.start(emotion="anger")
        streamed = await stream.follow(frames)
    (scored,) = await score(live, score_request(frames, emotion="anger"))
    assert bare(scored["estimates"]) == bare(streamed)


async def test_three_hundred_neighbours_change_no_bit(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="joy", by_emotion=True)
        alone = await stream.follow(FRAMES)
    async with asyncio.TaskGroup() as group:
        ready, stop = asyncio.Semaphore(0), asyncio.Event()
        neighbours = [group.create_task(_neighbour(live, number, ready, stop)) for number in range(300)]
        for _ in neighbours:
            await ready.acquire()
        async with talk(live) as stream:
            await stream.start(emotion="joy", by_emotion=True)
            beside = await stream.follow(FRAMES)
        stop.set()
    assert beside == alone


async def _neighbour(live: Live, number: int, ready: asyncio.Semaphore, stop: asyncio.Event) -> None:
    """Another session, that streams a motion of its own for as long as it may."""
    emotion = ["joy", "anger", None, {"fear": 0.5, "shame": 0.2}][number % 4]
    frames = frames_of(motion(60, seed=number + 1), rate_hz=[30.0, 60.0, 47.0][number % 3])
    async with talk(live, open_timeout=60) as stream:
        await stream.start(emotion=emotion, memory=["staggered", "stateful"][number % 2])
        ready.release()
        for frame in frames:
            await stream.send("frame", **frame)
            assert (await stream.hear())["type"] == "estimate"
            if stop.is_set():
                break


@pytest.mark.parametrize("subprotocol", sorted(CODECS))
async def test_every_encoding_says_the_same(subprotocol: str, live: Live) -> None:
    codec = CODECS[subprotocol]
    start = SessionStart(emotion="joy")
    frames = [Frame.model_validate(frame) for frame in FRAMES]
    async with websockets.connect(live.stream, subprotocols=[subprotocol], compression=None) as connection:
        for message in (start, *frames):
            await connection.send(codec.encode(message))
        heard = [codec.decode_server(await connection.recv()) for _ in (start, *frames)]
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        plain = await stream.follow(FRAMES)
    assert [estimate.seq for estimate in heard[1:]] == [estimate["seq"] for estimate in plain]
    assert [estimate.intensity for estimate in heard[1:]] == pytest.approx(
        [estimate["intensity"] for estimate in plain], abs=1e-5
    )


# --- time and limits --------------------------------------------------------------------------------------------------


async def test_a_session_that_never_starts_is_closed(start_service) -> None:
    async with talk(start_service(start_timeout_s=0.05)) as stream:
        await stream.send("ping")  # does not count as a start
        heard = [await stream.hear(), await stream.hear()]
        assert heard[1]["code"] == "start_timeout"
        assert heard[1]["message"] == "no session.start came for 0.05 s"
        assert (await stream.closed())[0] == 4408


async def test_a_silent_session_is_closed(start_service) -> None:
    async with talk(start_service(idle_timeout_s=0.05)) as stream:
        await stream.start()
        assert (await stream.hear())["code"] == "idle_timeout"
        assert (await stream.closed())[0] == 4408


async def test_too_many_frames_a_second_end_the_session(start_service) -> None:
    service = start_service(max_frames_per_second=10, max_frames_per_message=5)
    async with talk(service) as stream:
        await stream.start()
        for _ in range(4):
            await stream.send("frames", frames=FRAMES[:5])
        heard = [await stream.hear()]
        while heard[-1]["type"] != "error":
            heard.append(await stream.hear())
        assert heard[-1]["code"] == "rate_exceeded"
        assert heard[-1]["message"] == "more than 10 frames a second came"
        assert (await stream.closed())[0] == 4429


async def test_messages_that_cannot_be_read_count_as_what_they_had_room_for(start_service) -> None:
    async with talk(start_service(max_frames_per_second=100, max_frames_per_message=100)) as stream:
        await stream.start()
        nonsense = "[" * 40_000
        for expected in ("bad_message", "bad_message", "rate_exceeded"):
            await stream.socket.send(nonsense)
            assert (await stream.hear())["code"] == expected
        assert (await stream.closed())[0] == 4429


async def test_a_skeleton_with_too_many_joints_is_refused(start_service) -> None:
    service = start_service(max_joints=20)
    async with talk(service) as stream:
        error = await stream.start(skeleton="kinect_v2")
        assert error["message"] == "the skeleton has 25 joints; this service takes at most 20"
        assert (await stream.closed())[0] == 4400
    async with talk(service) as stream:
        assert (await stream.start())["limits"]["max_joints"] == 20


async def test_a_slow_reader_that_wants_the_latest_gets_it_and_is_never_closed(start_service) -> None:
    service = start_service(max_unsent_bytes=20_000, max_frames_per_second=1e9)
    service.bound.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16_384)  # its connections inherit it
    slow = RawClient(service)
    count = 600  # answers of 8 kB: many times what the sockets and the outbox hold

    def send() -> None:
        slow.send(b'{"type": "session.start", "delivery": "latest", "by_emotion": true}')
        slow.read_until(b"session.started")
        for seq in range(count):
            pose = {"seq": seq, "t": seq / 30, "q": FRAMES[seq % 90]["q"]}
            frames = [{"body": f"body {number}", **pose} for number in range(16)]
            slow.send(json.dumps({"type": "frames", "frames": frames}).encode())

    with slow.socket:
        await asyncio.to_thread(send)
        await eventually(lambda: service.service.drain.all_traffic().superseded > 0, seconds=30)
        received = await asyncio.to_thread(slow.read_until, f'"body 15","seq":{count - 1},'.encode())
    seqs = [int(number) for number in re.findall(rb'"body 15","seq":(\d+),', received)]
    assert seqs == sorted(set(seqs))
    assert len(seqs) < count
    await eventually(lambda: service.service.sessions.open == 0)
    assert service.service.drain.all_traffic().superseded > 0


async def test_a_message_with_too_many_frames_ends_nothing(start_service) -> None:
    async with talk(start_service(max_frames_per_message=5)) as stream:
        await stream.start()
        await stream.send("frames", frames=FRAMES[:6])
        error = await stream.hear()
        assert (error["code"], error["fatal"]) == ("bad_frame", False)
        assert len(await stream.follow(FRAMES)) == len(FRAMES)


async def test_a_client_far_ahead_is_held_back_and_loses_nothing(start_service) -> None:
    service = start_service(max_unanswered_frames=3)
    async with talk(service) as stream:
        await stream.start(emotion="joy")
        hurried = await stream.follow(FRAMES)
    async with talk(service) as stream:
        await stream.start(emotion="joy")
        patient = [estimate for frame in FRAMES for estimate in await stream.follow([frame])]
    assert hurried == patient


async def test_a_message_too_large_closes_with_1009(start_service) -> None:
    async with talk(start_service(max_message_bytes=2000)) as stream:
        await stream.start()
        await stream.send("ping", id="x" * 3000)
        assert (await stream.closed())[0] == 1009


async def test_one_session_too_many_is_told_to_come_later(start_service) -> None:
    service = start_service(max_sessions=1)
    async with talk(service) as first:
        await first.start()
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with talk(service):
                pass
        assert refused.value.response.status_code == 503
        assert refused.value.response.headers["retry-after"] == "1"
        assert len(await first.follow(FRAMES)) == len(FRAMES)
    async with talk(service) as next_one:
        await next_one.start()


async def test_a_full_engine_refuses_the_frame_and_keeps_the_session(start_service) -> None:
    service = start_service(capacity=1)
    async with talk(service) as first, talk(service) as second:
        await first.start()
        await first.follow(FRAMES[:1])
        await second.start()
        await second.send("frame", **FRAMES[0])
        error = await second.hear()
        assert (error["code"], error["fatal"]) == ("overloaded", False)
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with talk(service):
                pass
        assert b"all 1 bodies of this service are in use" in refused.value.response.body
        await first.send("body.end", body="0")
        await first.send("ping")
        await first.hear()
        assert len(await second.follow(FRAMES[:5])) == 5


@pytest.mark.parametrize("politely", [True, False])
async def test_a_client_that_goes_leaves_nothing_behind(politely: bool, start_service) -> None:
    service = start_service(capacity=4)
    taken = service.service.batcher.engine.slots.taken
    for _ in range(3):
        async with talk(service) as stream:
            await stream.start()
            for body in "abcd":
                await stream.send("frame", body=body, **FRAMES[0])
            await stream.hear()
            if not politely:
                stream.socket.transport.abort()
        await eventually(lambda: service.service.batcher.engine.slots.taken == taken)
        await eventually(lambda: service.service.sessions.open == 0)


async def test_a_slow_reader_is_told_and_closed(start_service) -> None:
    service = start_service(max_unsent_bytes=100_000)
    slow = RawClient(service)
    await asyncio.to_thread(slow.fall_deaf)
    close = b"\x88\x0c" + (1013).to_bytes(2, "big") + b"overloaded"
    received = await asyncio.to_thread(slow.read_until, close)
    assert b"the client reads its answers too slowly" in received
    assert received.endswith(close)
    slow.socket.close()


async def test_who_never_reads_is_left_behind_and_hurts_nobody(start_service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor.server.life.CLOSE_GRACE_S", 0.2)
    service = start_service(max_unsent_bytes=100_000)
    async with talk(service) as healthy:
        await healthy.start(emotion="joy")
        deaf = RawClient(service)
        sending = asyncio.create_task(asyncio.to_thread(deaf.fall_deaf))
        beside = await healthy.follow(FRAMES)
        await sending
        await eventually(lambda: service.service.sessions.open == 1)
        assert [estimate["seq"] for estimate in beside] == list(range(len(FRAMES)))
        deaf.socket.close()
