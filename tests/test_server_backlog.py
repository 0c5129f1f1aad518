"""When too much waits for the model, sessions are read no further; nothing is lost."""

import asyncio

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

    def run_down_to(self, depth: int) -> None:
        self.depth = depth
        for watcher in self.watchers:
            watcher(Run(1, 0.0, 0.0))


async def test_who_waits_comes_on_one_by_one() -> None:
    queue = Queue()
    backlog = Backlog(queue, Turn(queue), most=10)
    queue.depth = 10
    passed: list[int] = []

    async def session(number: int) -> None:
        await backlog.wait()
        queue.depth += 5
        passed.append(number)

    waiting = [asyncio.create_task(session(number)) for number in range(3)]
    await asyncio.sleep(0)
    queue.run_down_to(10)
    await asyncio.sleep(0)
    assert passed == []
    queue.run_down_to(6)
    for _ in range(3):
        await asyncio.sleep(0)
    assert passed == [0]  # it filled the queue again, and the others saw it
    queue.run_down_to(0)
    await asyncio.gather(*waiting)
    assert passed == [0, 1, 2]
    assert queue.depth == 10


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
