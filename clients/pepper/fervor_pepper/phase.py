"""What a performer is doing, and what that allows.

          start            ended, failed          rested
    IDLE ───────▶ ACTING ─────────────────▶ RESTING ─────▶ IDLE
                    │ overdue                  ▲
                    └─────────▶ STOPPING ──────┘ ended, failed, overdue

An act starts in IDLE alone, so no two overlap. A robot that never answers costs its act two timeouts, then the show
goes on.
"""

from collections.abc import Mapping
from enum import Enum, auto


class Phase(Enum):
    """What a performer is doing."""

    IDLE = auto()
    ACTING = auto()
    """The robot speaks or moves."""
    STOPPING = auto()
    """It was told to stop, and has not yet."""
    RESTING = auto()
    """A pause between two acts."""


class Cue(Enum):
    """What moves a performer on."""

    START = auto()
    ENDED = auto()
    FAILED = auto()
    OVERDUE = auto()
    RESTED = auto()


TRANSITIONS: Mapping[tuple[Phase, Cue], Phase] = {
    (Phase.IDLE, Cue.START): Phase.ACTING,
    (Phase.ACTING, Cue.ENDED): Phase.RESTING,
    (Phase.ACTING, Cue.FAILED): Phase.RESTING,
    (Phase.ACTING, Cue.OVERDUE): Phase.STOPPING,
    (Phase.STOPPING, Cue.ENDED): Phase.RESTING,
    (Phase.STOPPING, Cue.FAILED): Phase.RESTING,
    (Phase.STOPPING, Cue.OVERDUE): Phase.RESTING,
    (Phase.RESTING, Cue.RESTED): Phase.IDLE,
}
"""Every step there is; any other is a fault of the caller's."""
