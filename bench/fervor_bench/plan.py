"""What one run of `fervor bench` measures."""

from dataclasses import dataclass, field, replace
from typing import Literal

from fervor_bench.capacity import MOST_P99_MS, NEAR_P99_MS
from fervor_bench.contestant import CONTESTANTS, Contestant
from fervor_bench.errors import BenchError
from fervor_bench.generator import Arrivals, Load, Loop, Waits
from fervor_bench.traffic import Encoding, Traffic

Encodings = Literal["json", "msgpack", "both"]

SETTLE_S = 4.2
"""After so long on a sensor's clock a body of the service has both of its states, and costs what it will."""

WARMUP_S, TRIAL_WARMUP_S = 1.0, 0.5
"""Sent before the window; a trial of the search leaves out what sessions that go on do not need."""

SPIN_MOST = 1
"""Up to so many sessions the generator spins."""

BACKLOG_S = 0.25
"""So far behind, a service has lost an open loop: what waits at 10 ms each is nobody's idea of in time."""


@dataclass(frozen=True, slots=True)
class Plan:
    """All choices."""

    contestants: tuple[str, ...] = tuple(CONTESTANTS)
    encoding: Encodings = "both"
    traffic: Traffic = field(default_factory=Traffic)
    frames: tuple[int, ...] = (1, 6)
    """Frames in a message, tried one by one by who takes several."""
    sessions: tuple[int, ...] = (100,)
    """Numbers of sessions to try one by one."""
    loop: Loop = "open"
    arrivals: Arrivals = "random"
    seconds: float = 3.0
    lone_s: float = 5.0
    """Measured time of a lone session; 0: none is measured."""
    saturated: int = 64
    """Sessions of the closed loop that fills the contestant's processor."""
    idle: int = 1000
    """Sessions whose memory is taken; 0: none."""
    most_sessions: int = 8000
    """Where the search for the capacity ends; 0: no search."""
    search_s: float = 2.0
    """Measured time of a trial of the search."""
    resolution: float = 0.05
    attempts: int = 2
    confirm_s: float = 10.0
    """Measured time of the trial that has the last word on a capacity."""
    look_s: float = 2.0
    """Twice so long it looks at what the machine takes away from who is busy; 0: it does not."""

    def __post_init__(self) -> None:
        for name in self.contestants:
            if name not in CONTESTANTS:
                raise BenchError(f"contestant {name} is not known; expected some of {', '.join(CONTESTANTS)}")

    def load(self, sessions: int, *, seconds: float | None = None, settled: bool) -> Load:
        """One of the numbers of sessions; those that are not `settled` after connecting get there first."""
        seconds = self.seconds if seconds is None else seconds
        warmup_s = min(WARMUP_S, seconds / 2)
        return Load(
            sessions,
            self.loop,
            self.arrivals,
            warmup_s,
            seconds,
            settle_s=0.0 if settled else SETTLE_S,
            waits="spin" if sessions <= SPIN_MOST or self.loop == "closed" else "sleep",
            backlog_s=BACKLOG_S,
        )

    def filled(self, sessions: int, *, settled: bool) -> Load:
        """The closed loop."""
        load = replace(self.load(sessions, settled=settled), loop="closed", waits="spin")
        return replace(load, warmup_s=min(0.5, self.seconds / 2))

    def trial(self, sessions: int, *, settled: bool) -> Load:
        """An open loop of which only one thing is asked: whether it is kept, or nearly."""
        load = self.load(sessions, seconds=self.search_s, settled=settled)
        waits: Waits = "spin" if sessions <= SPIN_MOST else "sleep"
        warmup_s = min(TRIAL_WARMUP_S, load.warmup_s)
        return replace(load, loop="open", waits=waits, warmup_s=warmup_s, late_s=NEAR_P99_MS / 1000.0)

    def long_trial(self, sessions: int, *, settled: bool) -> Load:
        """The open loop that has the last word: whether it is kept."""
        return replace(
            self.trial(sessions, settled=settled),
            warmup_s=min(WARMUP_S, self.confirm_s / 2),
            seconds=self.confirm_s,
            late_s=MOST_P99_MS / 1000.0,
        )

    def entries(self) -> list[tuple[Contestant, Traffic]]:
        """Who runs with which traffic; a simple contestant gets what it understands.

        Raises:
            BenchError: a contestant can't take any of it.
        """
        found = []
        for contestant in (CONTESTANTS[name] for name in self.contestants):
            self._check(contestant)
            for encoding in contestant.encodings:
                if self.encoding in (encoding, "both"):
                    found += [(contestant, traffic) for traffic in self.traffics(contestant, encoding)]
        return found

    def traffics(self, contestant: Contestant | None, encoding: Encoding) -> list[Traffic]:
        """The traffic of a contestant in one encoding, by frames a message; None: of a service elsewhere."""
        simple = contestant is not None and not contestant.complete
        traffic = replace(self.traffic, encoding=encoding, checkpoints=self.traffic.checkpoints and not simple)
        return [
            replace(traffic, frames_per_message=frames)
            for frames in self.frames
            if contestant is None or contestant.groups or frames == 1
        ]

    def _check(self, contestant: Contestant) -> None:
        one = contestant.groups or 1 in self.frames
        if not contestant.complete and (self.traffic.joints != 13 or not one):
            raise BenchError(
                f"{contestant.name} takes 13 joints and one frame a message; leave it out with --contestants fervor"
            )


QUICK = Plan(
    contestants=("naive-tuned", "fervor", "floor"),
    frames=(1,),
    sessions=(),
    seconds=0.8,
    lone_s=2.0,
    idle=100,
    most_sessions=4000,
    search_s=0.8,
    resolution=0.25,
    attempts=1,
    confirm_s=0.0,
    look_s=1.0,
)
"""A minute or two; its figures are rough."""
