"""What tests of the robot share: estimates as a service would send them, and runs of the behaviour core."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from fervor.levels import Level
from fervor.protocol.messages import Estimate
from fervor_pepper.acts import Act, Command, Stop
from fervor_pepper.behaviour import Behaviour, Timing
from fervor_pepper.behaviour_file import default_behaviour
from fervor_pepper.performer import Performer


def estimate(emotion: str = "joy", level: str | None = "weak", **fields: Any) -> Estimate:
    told: dict[str, Any] = {"body": "0", "seq": 0, "t": 0.0, "intensity": 0.3, "status": "ok", "flags": ()}
    return Estimate(emotion=emotion, level=None if level is None else Level(level), **(told | fields))


def behaviour(**parts: Any) -> Behaviour:
    """The packaged behaviour with other parts."""
    return Behaviour.model_validate({**dict(default_behaviour()), **parts})


HASTY = Timing(settle_s=0.0, rest_s=0.0, emotion_rest_s=0.0, act_timeout_s=5.0)
"""No pauses, where a test is not about them."""


@dataclass
class Show:
    """A performer with what came of it: acts by the time at which they began."""

    performer: Performer
    now: float = 0.0
    acts: list[tuple[float, Act]] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)

    def wait(self, seconds: float) -> "Show":
        self.now += seconds
        return self._obey(self.performer.tick(self.now))

    def see(self, *arguments: Any, **fields: Any) -> "Show":
        return self.perceive(estimate(*arguments, **fields))

    def perceive(self, seen: Estimate) -> "Show":
        return self._obey(self.performer.perceive(seen, self.now))

    def watch(self, seconds: float, *arguments: Any, **fields: Any) -> "Show":
        """Ten estimates a second."""
        for _ in range(round(seconds * 10)):
            self.now += 0.1
            self.see(*arguments, **fields)
        return self

    def end(self) -> "Show":
        return self._obey(self.performer.ended(len(self.acts), self.now))

    def fail(self, *, reached: bool = True) -> "Show":
        return self._obey(self.performer.failed(len(self.acts), self.now, reached=reached))

    @property
    def said(self) -> list[str | None]:
        return [act.say for _, act in self.acts]

    @property
    def shown(self) -> list[str]:
        return [f"{act.level} {act.emotion} {act.body}" for _, act in self.acts]

    def _obey(self, commands: Iterable[Command]) -> "Show":
        for command in commands:
            if isinstance(command, Stop):
                self.stops.append(command.number)
            else:
                self.acts.append((self.now, command))
        return self


def show(parts: Behaviour | None = None, mode: Any = "expressive", seed: int = 0) -> Show:
    return Show(Performer(parts or behaviour(), mode, seed=seed))


Make = Callable[..., Show]
