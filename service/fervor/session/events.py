"""What a session asks its edge to do, and what the engine tells it back. Values only.

Data flows one way: message → session → `Ticket` → engine → `Outcome` → session → `Reply`.

What is made for every frame is a msgspec structure: made in C, at a fifth of a dataclass's cost, and nothing that the
garbage collector has to walk.
"""

from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from fervor.errors import CloseCode
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.messages import Flag, ServerMessage
from fervor.session.checkpoint import Bookkeeping, Memory
from fervor.session.label import Label
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.skeleton import Axes, Skeleton

Said = ServerMessage | LeanEstimate | LeanEstimates
"""What a session says, with estimates as they are given by the thousand."""


class Reply(msgspec.Struct, frozen=True, gc=False):
    """Send this message, after all earlier ones."""

    message: Said


@dataclass(frozen=True, slots=True)
class Close:
    """Close the connection, after all earlier messages."""

    code: CloseCode
    reason: str


@dataclass(frozen=True, slots=True)
class Release:
    """Give the slot back to the engine, after all earlier tickets."""

    slot: int


@dataclass(frozen=True, slots=True, eq=False)
class Restore:
    """Put what a checkpoint remembers into a slot that was just claimed, before its first ticket."""

    slot: int
    memory: Memory


class Source(msgspec.Struct, frozen=True):
    """What kind of joints a session sends; poses of equal sources are adapted together."""

    skeleton: Skeleton | Landmarks
    axes: Axes


class Block(msgspec.Struct, frozen=True, eq=False, gc=False):
    """The joints of frames of one source that came together."""

    joints: npt.NDArray[np.float64]  # [frame, joint, 4] rotations xyzw
    observed: npt.NDArray[np.bool_]  # [frame, joint]


class Pose(msgspec.Struct, frozen=True, eq=False, gc=False):
    """The joints of one frame in the order of its source's."""

    joints: npt.NDArray[np.float64]  # [joint, 4] rotations xyzw, or [joint, 3] positions of landmarks
    observed: npt.NDArray[np.bool_]  # [joint]
    unseen: bool | None = None
    """Whether no joint is observed, where that is known already."""
    block: Block | None = None
    """Whose row it is, if any: then its arrays are views."""
    row: int = 0

    @property
    def lost(self) -> bool:
        """Whether no joint is observed."""
        return not self.observed.any() if self.unseen is None else self.unseen

    def copy(self) -> "Pose":
        """The same in arrays of its own, to be kept."""
        return Pose(self.joints.copy(), self.observed.copy(), self.unseen)


class Step(msgspec.Struct, frozen=True, gc=False):
    """One model evaluation of a body."""

    fraction: float
    """Where between the body's pose before (0) and this ticket's (1)."""
    held: bool
    """The pose before stays, unobserved."""
    lanes: int
    """Row of the lane plan: which lanes run."""
    window: int
    """Poses to run from zero, where no lane does; else 0."""
    label: Label


class Ticket(msgspec.Struct, frozen=True, eq=False, gc=False):
    """The work that one frame brings; answered by one `Outcome`."""

    slot: int
    body: str
    seq: int
    time: float  # seconds, client clock
    source: Source
    pose: Pose | None
    """None where no joint was seen or the frame came late: nothing is to be computed."""
    fresh: bool
    """Nothing was before: the slot is cleared first."""
    steps: tuple[Step, ...]
    flags: tuple[Flag, ...]
    since: float  # seconds, time of the last reset
    group: int | None = None
    """The `frames` message it came in."""
    answer: bool = True
    """Whether it is a frame, to be answered by an estimate; else it only asks for a checkpoint."""
    checkpoint: Bookkeeping | None = None
    """What the body held right after this ticket was planned, where a checkpoint is due."""


class Outcome(msgspec.Struct, frozen=True, eq=False, gc=False):
    """What the engine made of a ticket."""

    intensity: float | None
    """Of the last step so far, in [0, 1]; None before the first."""
    by_emotion: npt.NDArray[np.float64]  # [emotion]
    seen: int
    """Upper-body joints of the rig observed in this frame."""
    jumped: int
    """Joints whose rotation was rejected as a jump."""
    memory: Memory | None = None
    """What the engine holds of the body after this ticket, where a checkpoint is due."""


Event = Reply | Close | Release | Restore | Ticket
