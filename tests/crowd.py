"""Robots that stream all at once while something happens to the service, and what each should have been told."""

import threading
from contextlib import AbstractContextManager
from typing import Self

import numpy as np

import fervor_client
from bodies import motion

RATE_HZ = 60.0
LONGEST = 6000
"""Frames: more than any test streams."""

LEAST = 90
"""Frames from each robot before anything happens to it, and afterwards."""

Told = list[fervor_client.Estimate]


class Robots(AbstractContextManager["Robots"]):
    """Streams in threads of their own: `with Robots(url, 4) as robots: kill_something()`.

    Inside the block all stream at 60 Hz; at its end each sends some frames more, and has `told` all it was told.
    """

    def __init__(self, url: str, count: int) -> None:
        self.told: list[Told] = [[] for _ in range(count)]
        self.reconnects = [0] * count
        self.failures: list[BaseException] = []
        self._url = url
        self._enough = threading.Event()
        self._settled = [threading.Event() for _ in range(count)]
        self._threads = [threading.Thread(target=self._run, args=(number,), daemon=True) for number in range(count)]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        self.settle()
        return self

    def __exit__(self, *_: object) -> None:
        self._enough.set()
        for thread in self._threads:
            thread.join(60)
        assert not any(thread.is_alive() for thread in self._threads)
        assert not self.failures

    def settle(self) -> None:
        """Wait until every robot was answered `LEAST` frames more."""
        for settled in self._settled:
            settled.clear()
        for settled in self._settled:
            assert settled.wait(60) or self.failures, "a robot is not answered any more"
        assert not self.failures

    def _run(self, number: int) -> None:
        try:
            self._stream(number)
        except BaseException as error:  # noqa: BLE001  # shown by the test's thread
            self.failures.append(error)
            self._settled[number].set()

    def _stream(self, number: int) -> None:
        def count(news: fervor_client.Reconnect) -> None:
            self.reconnects[number] += news.delay_s is None

        poses, since, left = motion(LONGEST, seed=number), 0, LEAST
        with fervor_client.sync.connect(self._url, emotion="joy", on_reconnect=count, retry_for=60) as session:
            for seq in range(LONGEST):
                self.told[number].append(session.estimate(poses[seq], seq=seq, t=seq / RATE_HZ, timeout=60))
                since = 0 if self._settled[number].is_set() else since + 1
                if since >= LEAST:
                    self._settled[number].set()
                if self._enough.wait(0 if self._enough.is_set() else 1 / RATE_HZ):
                    left -= 1
                    if left == 0:
                        return
        raise AssertionError(f"robot {number} ran out of frames")


def undisturbed(url: str, number: int, frames: int) -> Told:
    """What robot `number` is told by a service to which nothing happens."""
    poses: np.ndarray = motion(LONGEST, seed=number)[:frames]
    with fervor_client.sync.connect(url, emotion="joy") as session:
        for seq, pose in enumerate(poses):
            session.send(pose, seq=seq, t=seq / RATE_HZ)
        session.end()
        return list(session)


def assert_told_as_if_nothing_had_happened(robots: Robots, url: str) -> None:
    """Every frame of every robot was answered once, with the bits of an undisturbed stream."""
    for number, told in enumerate(robots.told):
        assert len(told) >= 2 * LEAST
        assert told == undisturbed(url, number, len(told))
