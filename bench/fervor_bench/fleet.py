"""Sessions of the load generator, kept from one load to the next.

What a trial costs beside its window is mostly what goes ahead of it: made-up messages, connecting, and the seconds of
frames after which a session costs what it will. Sessions that are there already are spared all that.
"""

import math
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from fervor_bench.contestant import Running
from fervor_bench.generator import Generator, Load, Seen
from fervor_bench.native import build
from fervor_bench.traffic import Traffic

VARIANTS, LEAST_VARIANTS = 32, 8
"""Different motions and clocks in one run: so many, or fewer where scripts would get long."""

MOST_PAYLOADS = 100_000
"""In a script, unless that leaves it fewer than `LEAST_VARIANTS`."""

MOST_MESSAGES = 40_000
"""Of one variant: a closed loop may come to their end, which ends its window."""

KEPT_S = 30.0
"""Seconds of open loops that one script lasts where sessions are kept."""

FASTEST_US = 3.0
"""No service here answers frames faster than this, so a closed loop needs no more messages."""


class Fleet:
    """The sessions on one service. As a context manager: whatever happens, they are gone afterwards."""

    def __init__(self, folder: Path, processor: int, traffic: Traffic, running: Running, *, most: int = 0) -> None:
        """Prepare.

        Args:
            folder: for what a run makes.
            processor: of the load generator.
            traffic: what is sent.
            running: the service.
            most: sessions that any of several loads has; 0: they are not kept for another load.
        """
        self._folder = folder
        self._processor = processor
        self._traffic = traffic
        self._running = running
        self._most = most
        self._generator: Generator | None = None
        self._made_for = Load(0)
        self._room = 0  # sessions that the generator can have
        self._left = 0  # messages of the script that a session has left

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def open(self, load: Load) -> int:
        """Have as many sessions as a load has, new ones where those of before do not fit it; returns how many started.

        Raises:
            BenchError: none could be started.
        """
        made_for = self._made_for
        same = (load.loop, load.arrivals, load.settle_s) == (made_for.loop, made_for.arrivals, made_for.settle_s)
        enough = self._left >= _messages_in_time(load, self._traffic) and self._room >= load.sessions
        if self._generator is None or not (same and enough):
            self._end()
            self._begin(load)
        assert self._generator is not None
        return self._generator.open(load.sessions)

    def run(self, load: Load, at_begin: Callable[[], None], at_end: Callable[[], None]) -> Seen:
        """Put a load on the service; the two callbacks are called at the edges of the measured window.

        Raises:
            BenchError: no session could be started, or the generator failed.
        """
        self.open(load)
        assert self._generator is not None
        seen = self._generator.run(load, at_begin, at_end)
        self._left -= _messages_in_time(load, self._traffic)
        if seen.under_way or seen.refused or seen.closed or seen.errors:
            self._end()  # what is left of this load is nothing to begin another with
        return seen

    def _begin(self, load: Load) -> None:
        self._room, self._left = max(load.sessions, self._most), _messages_in_time(load, self._traffic)
        if self._most:
            self._left = max(self._left, math.ceil(KEPT_S * _messages_a_second(self._traffic)))
        settle, script = messages_to_settle(load, self._traffic), self._folder / "script"
        script.unlink(missing_ok=True)  # another generator may be reading the one before
        self._traffic.write(
            script,
            address=self._running.address,
            target=self._running.path,
            variants=min(max(min(VARIANTS, MOST_PAYLOADS // (settle + self._left)), LEAST_VARIANTS), self._room),
            messages=settle + self._left,
            token=self._running.token,
        )
        self._made_for = load
        self._generator = Generator(
            build("load", self._folder),
            script,
            address=(self._running.host, self._running.port),
            most=self._room,
            arrivals=load.arrivals,
            settle=settle,
            processor=self._processor,
            result=self._folder / "result",
        )

    def _end(self) -> None:
        if self._generator is not None:
            self._generator.close()
            self._generator = None


def messages_to_settle(load: Load, traffic: Traffic) -> int:
    """Messages that one session sends ahead."""
    return math.ceil(load.settle_s * traffic.rate_hz / traffic.pictures_per_turn) * traffic.messages_per_turn


def messages_needed(load: Load, traffic: Traffic) -> int:
    """Messages that one session may send in a run."""
    return messages_to_settle(load, traffic) + _messages_in_time(load, traffic)


def _messages_in_time(load: Load, traffic: Traffic) -> int:
    seconds = load.warmup_s + load.seconds
    if load.loop == "open":
        turns = math.ceil(seconds * traffic.rate_hz / traffic.pictures_per_turn) + 1
        return turns * traffic.messages_per_turn
    frames = seconds / (FASTEST_US * 1e-6) / load.sessions
    return min(math.ceil(frames / traffic.frames_per_message) + 1, MOST_MESSAGES)


def _messages_a_second(traffic: Traffic) -> float:
    return traffic.rate_hz / traffic.pictures_per_turn * traffic.messages_per_turn
