"""What one run of `fervor bench` measures."""

from dataclasses import dataclass, field, replace
from typing import Literal

from fervor_bench.contestant import CONTESTANTS, Contestant
from fervor_bench.errors import BenchError
from fervor_bench.generator import Arrivals, Load, Loop
from fervor_bench.traffic import Encoding, Traffic

Encodings = Literal["json", "msgpack", "both"]


@dataclass(frozen=True, slots=True)
class Plan:
    """All choices."""

    contestants: tuple[str, ...] = tuple(CONTESTANTS)
    encoding: Encodings = "both"
    traffic: Traffic = field(default_factory=Traffic)
    sessions: tuple[int, ...] = (1, 100, 1000)
    """Numbers of sessions to try one by one."""
    loop: Loop = "open"
    arrivals: Arrivals = "random"
    seconds: float = 3.0
    saturated: int = 64
    """Sessions of the closed loop that fills the contestant's processor."""
    idle: int = 1000
    """Sessions whose memory is taken; 0: none."""
    most_sessions: int = 8000
    """Where the search for the capacity ends; 0: no search."""
    resolution: float = 0.05
    attempts: int = 2

    def __post_init__(self) -> None:
        for name in self.contestants:
            if name not in CONTESTANTS:
                raise BenchError(f"contestant {name} is not known; expected some of {', '.join(CONTESTANTS)}")

    def load(self, sessions: int) -> Load:
        """One of the numbers of sessions."""
        return Load(sessions, self.loop, self.arrivals, warmup_s=min(1.0, self.seconds / 2), seconds=self.seconds)

    def filled(self, sessions: int) -> Load:
        """The closed loop."""
        return Load(sessions, "closed", warmup_s=min(0.5, self.seconds / 2), seconds=self.seconds)

    def entries(self) -> list[tuple[Contestant, Traffic]]:
        """Who runs with which traffic; a simple contestant gets what it understands."""
        return [
            (contestant, self.traffic_for(contestant, encoding))
            for contestant in (CONTESTANTS[name] for name in self.contestants)
            for encoding in contestant.encodings
            if self.encoding in (encoding, "both")
        ]

    def traffic_for(self, contestant: Contestant, encoding: Encoding) -> Traffic:
        """The traffic in one encoding.

        Raises:
            BenchError: a simple contestant can't take so many joints or frames a message.
        """
        traffic = replace(self.traffic, encoding=encoding)
        if contestant.complete:
            return traffic
        plain = traffic.frames_per_message == 1 or contestant.name == "floor"
        if traffic.joints != 13 or not plain:
            raise BenchError(
                f"{contestant.name} takes 13 joints and one frame a message; leave it out with --contestants fervor"
            )
        return replace(traffic, checkpoints=False)


QUICK = Plan(
    contestants=("naive-tuned", "fervor", "floor"),
    sessions=(1,),
    seconds=0.8,
    idle=100,
    most_sessions=4000,
    resolution=0.25,
    attempts=1,
)
"""Under a minute; its figures are rough."""
