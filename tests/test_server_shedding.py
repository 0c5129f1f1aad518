"""Load is shed by how late the model is: new sessions are refused, the newest sent away, and no frame is dropped."""

import asyncio
import json

import pytest
import websockets

from bodies import motion
from fervor.engine.batcher import Run
from fervor.server.shedding import SUSTAINED_S, Shedding
from live import frames_of, talk
from test_server_backlog import Queue
from test_server_watched_file import Clock

LATE = Run(size=10, seconds=0.1, waited=0.5)
GOOD = Run(size=10, seconds=0.1, waited=0.3)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def shedding(clock: Clock) -> Shedding:
    return Shedding(Queue(), most_delay_s=0.5, clock=clock)


def run_for(seconds: float, run: Run, shedding: Shedding, clock: Clock) -> None:
    for _ in range(10):
        shedding.note(run)
        clock.now += seconds / 10


def test_late_runs_alone_for_a_second_are_overload(shedding: Shedding, clock: Clock) -> None:
    assert not shedding.overloaded
    run_for(SUSTAINED_S / 2, LATE, shedding, clock)
    assert not shedding.overloaded
    run_for(SUSTAINED_S, LATE, shedding, clock)
    assert shedding.overloaded


def test_one_run_in_time_ends_it(shedding: Shedding, clock: Clock) -> None:
    run_for(2 * SUSTAINED_S, LATE, shedding, clock)
    shedding.note(GOOD)
    assert not shedding.overloaded


def test_a_stall_is_no_overload(shedding: Shedding, clock: Clock) -> None:
    run_for(5.0, GOOD, shedding, clock)
    shedding.note(Run(size=10, seconds=0.1, waited=30.0))
    clock.now += 0.1
    assert not shedding.overloaded


def test_a_service_with_nothing_to_do_is_not_overloaded(shedding: Shedding, clock: Clock) -> None:
    run_for(2 * SUSTAINED_S, LATE, shedding, clock)
    clock.now += SUSTAINED_S + 0.1
    assert not shedding.overloaded
    shedding.note(LATE)  # the first after a pause begins a new second
    assert not shedding.overloaded


async def test_the_newest_session_is_told_to_go_and_the_others_go_on(
    start_service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fervor.server.shedding.SUSTAINED_S", 0.3)
    service = start_service(max_queue_delay_s=1e-9)  # every run is late
    frames = frames_of(motion(300))
    async with talk(service) as oldest, talk(service) as newest:
        await oldest.start(emotion="joy")
        await newest.start(emotion="joy")
        sent = asyncio.create_task(newest.closed())
        estimates: list[dict] = []
        while not sent.done():
            frame = frames[len(estimates)]
            await oldest.send("frame", **frame)
            estimates.append(await oldest.hear())
            await asyncio.sleep(0.01)
        assert (await sent)[0] == 1013
        assert [estimate["seq"] for estimate in estimates] == list(range(len(estimates)))
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with talk(service):
                pass
        problem = json.loads(refused.value.response.body)
        assert refused.value.response.status_code == 503
        assert refused.value.response.headers["retry-after"] == "1"
        assert problem["detail"] == "this service is late with the frames of those it has"


async def test_who_is_sent_away_is_told_when_to_come_back(start_service) -> None:
    service = start_service()
    async with talk(service) as stream:
        await stream.start()
        (conversation,) = service.service.drain.talking
        conversation._loop.call_soon_threadsafe(conversation.send_away, 5.0)
        error = await stream.hear()
        assert (error["code"], error["fatal"], error["retry_after"]) == ("overloaded", True, 5.0)
        assert (await stream.closed())[0] == 1013
