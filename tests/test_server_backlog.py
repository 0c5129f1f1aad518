"""When too much waits for the model, sessions are read no further; nothing is lost."""

import asyncio
from functools import partial

from bodies import motion
from fervor.engine.batcher import Run
from fervor.server.backlog import Backlog
from fervor.server.turn import Turn
from live import frames_of, talk


class Queue:
    """As much of a batcher as a backlog looks at."""

    def __init__(self) -> None:
        self.depth = 0
        self.watchers: list = []

    def watch(self, watcher) -> None:
        self.watchers.append(watcher)

    def run(self) -> None:
        """Nothing waits, so no run follows."""

    def run_down_to(self, depth: int) -> None:
        self.depth = depth
        for watcher in self.watchers:
            watcher(Run(1, 0.0, 0.0))


class Silent:
    """A conversation that brings nothing."""

    agreement = None

    def decode_frames(self, message) -> None:
        return None

    def take(self, message, raw, poses) -> None:
        pass


async def test_who_waits_comes_on_one_by_one() -> None:
    queue = Queue()
    backlog = Backlog(queue, Turn(queue), most=10)
    queue.depth = 10
    passed: list[int] = []

    def bring(number: int) -> None:
        queue.depth += 5
        passed.append(number)

    for number in range(3):
        backlog.wait(partial(bring, number))
    queue.run_down_to(10)
    assert passed == []
    queue.run_down_to(6)
    assert passed == [0]  # it filled the queue again, and the others saw it
    queue.run_down_to(0)
    assert passed == [0, 1, 2]
    assert queue.depth == 10


async def test_a_turn_that_brings_no_tickets_leaves_nobody_waiting() -> None:
    queue = Queue()
    turn = Turn(queue)
    backlog = Backlog(queue, turn, most=1)
    turn.put(Silent(), "a ping")
    assert backlog.full
    room = asyncio.Event()
    backlog.wait(room.set)
    await room.wait()
    assert not backlog.full


async def test_a_short_queue_changes_no_estimate(start_service) -> None:
    frames = frames_of(motion(60))
    service = start_service(max_queue=2)
    deepest: list[int] = []
    service.service.batcher.watch(lambda _: deepest.append(service.service.batcher.depth))
    async with talk(service) as alone:
        await alone.start(emotion="joy")
        expected = await alone.follow(frames)
    async with talk(service) as first, talk(service) as second, talk(service) as third:
        for stream in (first, second, third):
            await stream.start(emotion="joy")
        together = await asyncio.gather(*(stream.follow(frames) for stream in (first, second, third)))
    assert together == [expected] * 3
    assert max(deepest) <= 2 + 3
    assert service.service.batcher.depth == 0
