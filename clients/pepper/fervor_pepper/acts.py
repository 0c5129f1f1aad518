"""What the core asks of a robot: one act at a time, and to stop it. Plain values, the same for any robot."""

from dataclasses import dataclass

from fervor.levels import Level


@dataclass(frozen=True, slots=True)
class Voice:
    """A language to speak."""

    code: str
    """As in the behaviour file, like `en`."""
    name: str
    """As the robot calls it, like `English`."""


@dataclass(frozen=True, slots=True)
class Act:
    """One thing to do: to speak, to move, or both together; lights go along."""

    number: int
    """Counts the acts of a performer, from 1; its end is told by it."""
    voice: Voice
    say: str | None = None
    gestures: tuple[str, ...] = ()
    """Names of animations, the preferred first; the robot plays the first that it has."""
    leds: int | None = None
    """Colour of the eyes, 0xRRGGBB."""
    body: str | None = None
    """The person it answers; None: nobody, as a filler."""
    emotion: str | None = None
    level: Level | None = None


@dataclass(frozen=True, slots=True)
class Stop:
    """End an act that takes too long."""

    number: int


Command = Act | Stop


def pick_gesture(preferred: tuple[str, ...], available: frozenset[str] | None) -> tuple[str, ...]:
    """The gestures worth trying, in order: the first that the robot has, or all where it can't say what it has."""
    if available is None:
        return preferred
    return next(((name,) for name in preferred if name in available), ())
