"""What watchers of the live page get: the sessions as they are, bounded, and only who may."""

import asyncio
import json
from contextlib import asynccontextmanager, suppress

import httpx
import numpy as np
import pytest
import websockets

from bodies import motion
from fervor.server.watch_messages import MOST_SHOWN, SUBPROTOCOL
from fervor.skeletons.rig import JOINTS, PARENTS
from live import PROTOCOL, Live, eventually, frames_of, talk


class Watcher:
    """One who watches."""

    def __init__(self, connection) -> None:
        self.socket = connection

    async def hear(self) -> dict:
        async with asyncio.timeout(20):
            return json.loads(await self.socket.recv())

    async def see(self, condition) -> dict:
        """The first picture that is as wanted."""
        while True:
            picture = await self.hear()
            if condition(picture):
                return picture

    async def look(self, **fields) -> None:
        await self.socket.send(json.dumps({"type": "look", **fields}))


@asynccontextmanager
async def watch(live: Live, *tokens: str, **options):
    wanted = [SUBPROTOCOL, *(f"fervor.token.{token}" for token in tokens)]
    address = live.stream.replace("/stream", "/watch")
    async with websockets.connect(address, subprotocols=wanted, compression=None, **options) as connection:
        yield Watcher(connection)


async def test_a_watcher_is_told_what_it_needs_to_draw(live: Live) -> None:
    async with watch(live) as watcher:
        assert watcher.socket.subprotocol == SUBPROTOCOL
        started = await watcher.hear()
    assert started["type"] == "watch.started"
    assert tuple(started["joints"]) == JOINTS
    assert tuple(started["parents"]) == PARENTS
    assert started["model"]["purpose"] == "demo"
    assert 0.0 < started["hysteresis"] < 0.5


async def test_a_watcher_sees_pose_and_estimate_of_the_newest_frame(start_service) -> None:
    live = start_service()
    frames = frames_of(motion(40))
    async with watch(live) as watcher, talk(live) as stream:
        await watcher.hear()
        started = await stream.start(emotion="joy")
        estimates = await stream.follow(frames, body="anna")
        picture = await watcher.see(lambda seen: seen["bodies"] and seen["bodies"][0]["seq"] == 39)
    (body,) = picture["bodies"]
    last = estimates[-1]
    assert {name: body[name] for name in ("body", "intensity", "level", "emotion", "status", "t")} == {
        name: last[name] for name in ("body", "intensity", "level", "emotion", "status", "t")
    }
    assert body["threshold"] == started["model"]["thresholds"]["joy"]
    assert np.allclose(np.abs(np.sum(np.array(body["q"]) * frames[-1]["q"], axis=-1)), 1.0, atol=1e-3)
    assert body["observed"] == [True] * 13
    assert body["by_emotion"] is None
    assert picture["sessions"] == [{"session": started["session_id"], "skeleton": "c13", "bodies": 1, "frames": 40}]


async def test_other_emotions_are_told_of_the_bodies_asked_for(start_service) -> None:
    live = start_service()
    async with watch(live) as watcher, talk(live) as stream:
        session = (await stream.start(emotion="joy", by_emotion=True))["session_id"]
        await stream.follow(frames_of(motion(5)), body="bert")
        (last,) = await stream.follow([{**frame, "seq": 6} for frame in frames_of(motion(6))[5:]], body="anna")
        await watcher.look(by_emotion=[{"session": session, "body": "anna"}])
        picture = await watcher.see(lambda seen: any(body.get("by_emotion") for body in seen.get("bodies", ())))
    told = {body["body"]: body["by_emotion"] for body in picture["bodies"]}
    assert told == {"bert": None, "anna": last["by_emotion"]}
    assert told["anna"]["joy"] == last["intensity"]


async def test_a_body_is_not_shown_before_it_is_answered(start_service) -> None:
    """Its place in the engine may still hold the pose of somebody who left."""
    live = start_service(capacity=1)
    async with talk(live) as first:
        await first.start()
        await first.follow(frames_of(motion(3)))
    async with watch(live) as watcher, talk(live) as second:
        await second.start()
        picture = await watcher.see(lambda seen: seen.get("sessions_total") == 1)
        assert picture["bodies"] == []
        await second.follow([{"seq": 0, "t": 0.0, "q": [None] * 13}])
        picture = await watcher.see(lambda seen: seen["bodies"])
    assert picture["bodies"][0]["observed"] == [False] * 13
    assert picture["bodies"][0]["q"] == [[0.0, 0.0, 0.0, 1.0]] * 13
    assert picture["bodies"][0]["intensity"] is None


async def test_a_picture_is_bounded_and_can_be_leafed_through(start_service) -> None:
    live = start_service(max_bodies=40)
    async with watch(live) as watcher, talk(live) as stream:
        await stream.start()
        for body in range(MOST_SHOWN + 3):
            await stream.follow(frames_of(motion(1)), body=str(body))
        whole = await watcher.see(lambda seen: seen.get("bodies_total") == MOST_SHOWN + 3)
        assert [body["body"] for body in whole["bodies"]] == [str(at) for at in range(MOST_SHOWN)]
        await watcher.look(first=MOST_SHOWN)
        rest = await watcher.see(lambda seen: seen["first"])
        assert [body["body"] for body in rest["bodies"]] == [str(MOST_SHOWN + at) for at in range(3)]
        for body in range(5):
            await stream.send("body.end", body=str(body))
        back = await watcher.see(lambda seen: seen["bodies_total"] == MOST_SHOWN - 2)
        assert back["first"] == 0, "a page that is gone is no place to stay"


async def test_what_nobody_understands_ends_the_watch_alone(start_service) -> None:
    live = start_service()
    for said in ('{"type": "frame"}', "no json", b"\x00", json.dumps({"type": "look", "first": -1})):
        async with talk(live) as stream, watch(live) as watcher:
            await stream.start()
            await watcher.socket.send(said)
            with suppress(websockets.ConnectionClosed):
                while True:
                    await watcher.hear()
            assert watcher.socket.close_code == 4400
            assert (await stream.follow(frames_of(motion(1))))[0]["seq"] == 0
    await eventually(lambda: live.service.watchers.open == 0)


async def test_who_asks_without_end_is_cut_off(start_service) -> None:
    live = start_service()
    async with watch(live) as watcher:
        with suppress(websockets.ConnectionClosed):
            for first in range(10_000):
                await watcher.look(first=first)
        with suppress(websockets.ConnectionClosed):
            while True:
                await watcher.hear()
    assert watcher.socket.close_code == 4429
    await eventually(lambda: live.service.watchers.open == 0)


async def test_a_fault_of_ours_costs_the_watcher_alone(start_service, monkeypatch) -> None:
    live = start_service()
    async with watch(live) as watcher, talk(live) as stream:
        await watcher.see(lambda seen: seen["type"] == "snapshot")
        monkeypatch.setattr("fervor.server.watch.take_snapshot", lambda *_: 1 / 0)
        with suppress(websockets.ConnectionClosed):
            while True:
                await watcher.hear()
        assert watcher.socket.close_code == 1011
        await stream.start()
        assert len(await stream.follow(frames_of(motion(3)))) == 3


async def test_there_is_room_for_so_many_watchers(start_service) -> None:
    live = start_service(max_watchers=1)
    async with watch(live):
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with watch(live):
                pass
        assert refused.value.response.status_code == 503
        assert refused.value.response.headers["retry-after"]
    await eventually(lambda: live.service.watchers.open == 0)
    async with watch(live) as watcher:
        assert (await watcher.hear())["type"] == "watch.started"


async def test_watchers_need_a_token_where_clients_do(start_service) -> None:
    live = start_service(tokens="alpha")
    for tokens in ((), ("beta",)):
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with watch(live, *tokens):
                pass
        assert refused.value.response.status_code == 401
    async with watch(live, "alpha") as watcher:
        assert (await watcher.hear())["type"] == "watch.started"


async def test_watchers_can_have_tokens_of_their_own(start_service) -> None:
    live = start_service(tokens="robot", page_tokens="eyes")
    with pytest.raises(websockets.InvalidStatus):
        async with watch(live, "robot"):
            pass
    with pytest.raises(websockets.InvalidStatus):
        async with talk(live, subprotocols=[PROTOCOL, "fervor.token.eyes"]):
            pass
    async with watch(live, "eyes") as watcher:
        assert (await watcher.hear())["type"] == "watch.started"


async def test_pages_of_elsewhere_see_nothing(live: Live) -> None:
    with pytest.raises(websockets.InvalidStatus) as refused:
        async with watch(live, origin="https://elsewhere.example"):
            pass
    assert refused.value.response.status_code == 403
    async with watch(live, origin=live.url) as watcher:
        assert (await watcher.hear())["type"] == "watch.started"


def test_there_is_nothing_where_the_page_is_off(start_service) -> None:
    live = start_service(page="off")
    with httpx.Client(base_url=live.url) as client:
        for path in ("/", "/page/index.html", "/v1/watch"):
            assert client.get(path).status_code == 404, path


def test_who_asks_without_an_upgrade_is_told(http: httpx.Client) -> None:
    answer = http.get("/v1/watch")
    assert answer.status_code == 426
    assert answer.json()["detail"] == "/v1/watch is a WebSocket; expected a request for an upgrade to it"
