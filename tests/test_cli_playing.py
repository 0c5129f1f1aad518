import asyncio
from itertools import islice
from pathlib import Path
from typing import Self

import numpy as np
import pytest

import fervor_client
from bodies import motion
from fervor.cli.playing import SEAM_S, Take, play
from fervor.protocol.messages import Estimate
from fervor.recordings.bvh import read_bvh
from live import Live
from program import write_bvh


class Shown(list[Estimate]):
    """A screen that remembers."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def show(self, estimate: Estimate) -> None:
        self.append(estimate)


def take(frames: int, rate_hz: float = 60.0) -> Take:
    return Take("walk", np.arange(frames) / rate_hz, motion(frames))


def test_a_recording_becomes_a_take_on_the_rig(tmp_path: Path) -> None:
    found = Take.of(read_bvh(write_bvh(tmp_path / "wave.bvh", seconds=1.0)))
    assert (found.name, found.poses.shape, found.duration_s) == ("wave", (61, 13, 4), pytest.approx(1.0, abs=1e-4))
    untracked = np.isnan(found.poses)
    assert (untracked.all(axis=(0, 2)) == untracked.any(axis=(0, 2))).all()
    assert not untracked.all()


def test_frames_come_in_order_and_once() -> None:
    walk = take(5)
    frames = list(walk.frames())
    assert [time for time, _ in frames] == walk.times.tolist()
    assert all((pose == expected).all() for (_, pose), expected in zip(frames, walk.poses, strict=True))


def test_a_loop_goes_on_in_time_with_a_short_seam() -> None:
    times = [time for time, _ in islice(take(3, rate_hz=10.0).frames(loop=True), 7)]
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.2 + SEAM_S, 0.3 + SEAM_S, 0.4 + SEAM_S, 0.4 + 2 * SEAM_S])


def test_a_loop_ends_after_its_seconds() -> None:
    times = [time for time, _ in take(3, rate_hz=10.0).frames(loop=True, seconds=5.0)]
    assert 4.7 < times[-1] <= 5.0


async def test_all_estimates_are_shown_and_the_session_is_ended(live: Live) -> None:
    shown, walk = Shown(), take(90)
    async with fervor_client.connect(live.stream, emotion="joy", window=8) as session:
        await play(session, walk.frames(), shown, body="ann", fast=True)
        assert (await session.end()).estimates == 90
    assert [(estimate.body, estimate.seq) for estimate in shown] == [("ann", seq) for seq in range(90)]
    assert [estimate.t for estimate in shown] == walk.times.tolist()


async def test_frames_leave_when_they_are_due(live: Live) -> None:
    """Never early, whatever the machine does; what is late is not pinned here."""
    loop = asyncio.get_running_loop()
    left: list[float] = []

    def frames():
        for time, pose in take(31, rate_hz=60.0).frames():
            left.append(loop.time())
            yield time, pose

    async with fervor_client.connect(live.stream) as session:
        await play(session, frames(), shown := Shown())
    assert len(shown) == 31
    # A frame is drawn once the one before has left.
    assert all(later - left[0] >= (number - 1) / 60.0 - 0.002 for number, later in enumerate(left) if number)


async def test_fast_stays_below_what_the_service_allows(live: Live) -> None:
    async with fervor_client.connect(live.stream) as session:
        limits = session.limits.model_copy(update={"max_frames_per_second": 200.0})
        session._conversation.started = session.started.model_copy(update={"limits": limits})
        loop = asyncio.get_running_loop()
        begin = loop.time()
        await play(session, take(41).frames(), shown := Shown(), fast=True)
        assert len(shown) == 41
        assert loop.time() - begin >= 0.2


async def test_an_interrupted_play_ends_the_session(live: Live) -> None:
    shown = Shown()
    async with fervor_client.connect(live.stream) as session:
        playing = asyncio.create_task(play(session, take(2).frames(loop=True), shown))
        async with asyncio.timeout(10):
            while not shown:
                await asyncio.sleep(0.01)
        playing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await playing
        assert (await session.end()).frames >= 1


async def test_frames_that_fail_end_the_session_too(live: Live) -> None:
    def failing():
        yield 0.0, motion(1)[0]
        raise ZeroDivisionError

    async with fervor_client.connect(live.stream) as session:
        with pytest.raises(ZeroDivisionError):
            await play(session, failing(), shown := Shown())
        assert len(shown) == 1
        assert (await session.end()).frames == 1


async def test_a_lost_session_is_raised(start_service) -> None:
    service = start_service(shutdown_grace_s=0)
    async with fervor_client.connect(service.stream) as session:
        playing = asyncio.create_task(play(session, take(2).frames(loop=True), Shown()))
        await asyncio.to_thread(service.stop)
        with pytest.raises(fervor_client.Unreachable, match="closed the connection"):
            await playing
