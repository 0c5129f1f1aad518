"""The plan of a take: everything that happens in it, drawn once, before any frame is computed.

`Director` writes it (arms), with `Company` (trunk, head, feet); `body` reads it. Times are seconds from the take's
begin; plans start earlier, because bodies are mostly in mid-motion when a take begins.
"""

from dataclasses import dataclass, field

import numpy as np

from fervor_export.synthetic.arm import SHOULDER
from fervor_export.synthetic.gestures import Pose
from fervor_export.synthetic.manner import Manner
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.tracks import Array, Track, Wobble


class Hand:
    """Places in the vector that says where a hand is and how it is turned."""

    CHEST = slice(0, 3)  # metres, fixed to the chest
    ROOM = slice(3, 6)  # metres, fixed to the room
    FROM_ROOM = 6  # 1: the place in the room is meant from the upright body's chest, else from the moving shoulder
    SWING = 7  # 1: hangs, and swings with the gait
    ELBOW, PALM, BEND, SIDE = 8, 9, 10, 11  # degrees
    DIM = 12


class Torso:
    """Places in the trunk's vector: pitch, yaw and roll in degrees, shoulders in metres."""

    SPINE, THORAX, HEAD, SHRUG = slice(0, 3), slice(3, 6), slice(6, 9), 9
    DIM = 10


class Legs:
    """Places in the legs' vector: left and right hip, left and right knee, degrees of flexion."""

    DIM = 4


Stretch = tuple[float, float]
"""Begin and end in seconds."""


@dataclass(frozen=True, slots=True)
class Laugh:
    """One bout of laughter; seconds, degrees, Hz."""

    start: float
    duration: float
    strength: float
    hz: float


@dataclass(frozen=True, slots=True)
class Unrest:
    """What never stops in a living body: noise and rhythms."""

    sway: Wobble  # [9] slow: spine, chest, head
    drift: Wobble  # [14] hands and elbows, and how the bounce varies
    texture: Wobble  # [21] 2 to 6 Hz: trunk 9, legs 4, hands 2 x 4
    tremor: Wobble  # [12] 7 to 11 Hz: hands 2 x 6
    breath: float  # phases in radians
    bounce: float
    step: float
    bounce_hz: float

    @classmethod
    def draw(cls, rng: np.random.Generator, person: Person) -> "Unrest":
        """The unrest of one take."""
        breath, bounce, step = rng.uniform(0.0, 2.0 * np.pi, 3).tolist()
        return cls(
            sway=Wobble.draw(rng, low_hz=0.08, high_hz=0.9, dim=9),
            drift=Wobble.draw(rng, low_hz=0.15, high_hz=2.2, dim=14),
            texture=Wobble.draw(rng, low_hz=1.8, high_hz=6.0, dim=21, terms=9),
            tremor=Wobble.draw(rng, low_hz=6.5, high_hz=11.0, dim=12, terms=6),
            breath=breath,
            bounce=bounce,
            step=step,
            bounce_hz=float(rng.normal(2.0, 0.2)) * person.tempo**0.5,
        )


@dataclass(frozen=True, slots=True)
class Script:
    """Everything that happens in a take."""

    person: Person
    scene: Scene
    manner: Manner
    seconds: float
    hands: tuple[Track, Track]  # left, right [Hand.DIM]
    trunk: Track  # [Torso.DIM]
    legs: Track  # [Legs.DIM] added to the scene's
    unrest: Unrest
    way: float  # -1 or 1: the side to which the head turns away
    events: tuple[float, ...] = ()  # seconds at which the emotion visibly begins
    laughs: list[Laugh] = field(default_factory=list)
    emblems: list[Stretch] = field(default_factory=list)  # when the emotion's own gestures were made
    gestures: list[Stretch] = field(default_factory=list)  # when any were made


def place(pose: Pose, scene: Scene, person: Person) -> Array:
    """A pose as a hand's vector [Hand.DIM]."""
    vector = np.zeros(Hand.DIM)
    vector[Hand.ELBOW :] = pose.elbow + person.elbows, pose.palm, pose.bend, 0.0
    if pose.anchor == "shoulder":
        length = person.hang * (person.upper_arm + person.forearm)
        vector[Hand.CHEST] = SHOULDER, 0.0, 0.0
        vector[Hand.ROOM] = person.arm_out, -np.sqrt(length**2 - person.arm_out**2 - 0.05**2), 0.05
        vector[Hand.SWING] = 1.0
    elif pose.anchor == "room":
        standing = scene.posture != "sit"
        vector[Hand.ROOM] = pose.out, pose.up - 0.06 * standing, pose.fore - 0.18 * standing
        vector[Hand.FROM_ROOM] = 1.0
    else:
        vector[Hand.CHEST] = pose.out, pose.up, pose.fore
    return vector


def around(begin: Array, end: Array) -> tuple[float, Array]:
    """How a hand gets from one vector [Hand.DIM] to another: metres of way, and the bow [Hand.DIM] it makes on it.

    An arm that swings from low to high turns about its shoulder, the hand on an arc; on the straight line it would pass
    through the shoulder.
    """
    shoulder = np.array([SHOULDER, 0.0, 0.0])
    first, last = begin[Hand.CHEST] + begin[Hand.ROOM] - shoulder, end[Hand.CHEST] + end[Hand.ROOM] - shoulder
    middle = 0.5 * (first + last)
    wanted = 0.45 * float(np.linalg.norm(first) + np.linalg.norm(last))
    missing = max(wanted - float(np.linalg.norm(middle)), 0.0)
    direction = middle + np.array([0.08, 0.0, 0.22])
    bow = np.zeros(Hand.DIM)
    bow[Hand.CHEST] = missing * direction / max(float(np.linalg.norm(direction)), 1e-6)
    return float(np.linalg.norm(last - first)) + missing, bow
