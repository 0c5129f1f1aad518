"""Streams survive the service: a drain hands out last checkpoints, a kill -9 costs nothing that was checkpointed."""

import asyncio
import json
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import httpx
import pytest
import websockets

from bodies import motion
from fervor.protocol.messages import Totals
from fervor.server.draining import Drain
from live import PROTOCOL, Live, frames_of, talk
from program import start_fervor

KEY = "a key for tests that is long enough"
OTHER = "another key that is long enough too"
START = {"type": "session.start", "emotion": "joy", "checkpoint_s": 0.5}


@asynccontextmanager
async def service(*, keys: str = KEY, options: tuple[str, ...] = ()) -> AsyncIterator[tuple]:
    """The program in a process of its own: (process, address)."""
    process = start_fervor("serve", "--port", "0", *options, FERVOR_CHECKPOINT_KEYS=keys)
    try:
        for line in process.stderr:
            if "listening on http://" in line:
                break
        yield process, line.rstrip().rpartition("http://")[2]
    finally:
        process.kill()
        await asyncio.to_thread(process.communicate)


def connected(address: str):
    return websockets.connect(f"ws://{address}/v1/stream", subprotocols=[PROTOCOL], compression=None)


async def say(socket, message: dict) -> None:
    await socket.send(json.dumps(message))


async def hear(socket) -> dict:
    return json.loads(await socket.recv())


async def follow(socket, frames: list[dict]) -> tuple[dict[int, dict], dict | None]:
    """Send frames; their estimates by seq, and the newest checkpoint."""
    for frame in frames:
        await say(socket, {"type": "frame", "body": "eve", **frame})
    estimates: dict[int, dict] = {}
    checkpoint = None
    while len(estimates) < len(frames):
        message = await hear(socket)
        if message["type"] == "checkpoint":
            checkpoint = message
        else:
            estimates[message["seq"]] = message
    return estimates, checkpoint


async def uninterrupted(live: Live, frames: list[dict]) -> dict[int, dict]:
    async with talk(live) as conversation:
        await say(conversation.socket, {**START, "checkpoint_s": None})
        await hear(conversation.socket)
        estimates, _ = await follow(conversation.socket, frames)
        return estimates


FRAMES = frames_of(motion(300), rate_hz=40.0)


@pytest.mark.parametrize("keys", [KEY, f"{OTHER},{KEY}"])
async def test_a_killed_service_costs_nothing_that_was_checkpointed(live: Live, keys: str) -> None:
    expected = await uninterrupted(live, FRAMES)
    async with service() as (first, address), connected(address) as socket:
        await say(socket, START)
        await hear(socket)
        got, checkpoint = await follow(socket, FRAMES[:170])
        first.send_signal(signal.SIGKILL)
    assert checkpoint is not None
    async with service(keys=keys) as (_, address), connected(address) as socket:
        await say(socket, {**START, "resume": [checkpoint["token"]]})
        started = await hear(socket)
        assert started["resumed"] == [{"body": "eve", "seq": checkpoint["seq"], "same_runtime": True}]
        replayed, _ = await follow(socket, FRAMES[checkpoint["seq"] + 1 :])
    assert {**got, **replayed} == expected
    assert all(got[seq] == replayed[seq] for seq in got.keys() & replayed.keys())


async def test_a_service_with_another_key_refuses_the_checkpoint() -> None:
    async with service() as (_, address), connected(address) as socket:
        await say(socket, START)
        await hear(socket)
        _, checkpoint = await follow(socket, FRAMES[:30])
    async with service(keys=OTHER) as (_, address), connected(address) as socket:
        await say(socket, {**START, "resume": [checkpoint["token"]]})
        error = await hear(socket)
        assert (error["code"], error["fatal"]) == ("checkpoint_unknown", True)
        with pytest.raises(websockets.ConnectionClosed) as closed:
            await socket.recv()
        assert closed.value.rcvd.code == 4404


async def test_sigterm_hands_out_last_checkpoints_and_says_1012(live: Live) -> None:
    expected = await uninterrupted(live, FRAMES)
    start = {**START, "checkpoint_s": 60.0}
    async with service() as (first, address), connected(address) as socket:
        await say(socket, start)
        await hear(socket)
        got, _ = await follow(socket, FRAMES[:123])
        first.send_signal(signal.SIGTERM)
        going, last = await hear(socket), await hear(socket)
        assert going == {"type": "going_away", "seconds": 5.0}
        assert (last["type"], last["body"], last["seq"]) == ("checkpoint", "eve", 122)
        with pytest.raises(websockets.ConnectionClosed) as closed:
            await socket.recv()
        assert closed.value.rcvd.code == 1012
        assert await asyncio.to_thread(first.wait, 20) == 0
    async with service() as (_, address), connected(address) as socket:
        await say(socket, {**start, "resume": [last["token"]]})
        await hear(socket)
        rest, _ = await follow(socket, FRAMES[123:])
    assert {**got, **rest} == expected


def status(url: str) -> httpx.Response:
    return httpx.get(url, timeout=30)


async def test_while_it_drains_it_is_not_ready_and_lets_nobody_in(start_service) -> None:
    service = start_service()
    assert status(f"{service.url}/readyz").status_code == 200
    service.service.drain.started = True
    answer = status(f"{service.url}/readyz")
    assert (answer.status_code, answer.json()["code"], answer.headers["Retry-After"]) == (503, "going_away", "1")
    assert status(f"{service.url}/healthz").status_code == 200
    with pytest.raises(websockets.InvalidStatus) as refused:
        async with talk(service):
            pass
    assert refused.value.response.status_code == 503
    assert refused.value.response.headers["Retry-After"]


async def test_a_drain_does_not_wait_for_ever() -> None:
    drain = Drain()

    class Deaf:
        totals = Totals()

        def go_away(self, seconds: float) -> None:
            pass

    drain.enter(Deaf())
    assert not await drain.run(0.05)
    assert drain.started
