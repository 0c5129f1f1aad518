"""What arms do, as data: poses of the hand that a gesture leads through, and which emotion uses which gesture.

A pose gives the wrist in metres from the middle between the shoulders of a body with arms of 0.56 m: `out` to the
hand's own side (0.18 is the shoulder, 0 the midline, negative beyond it), `up`, `fore`. Both hands use the same
numbers, mirrored. Angles in degrees: `elbow` turns the elbow outward, `palm` turns the forearm (0 thumb up, + palm
down, - palm up), `bend` is the wrist's (+ towards the palm).

Kinds after the behaviours that observers coded: Wallbott 1998, Dael et al. 2012 (BAP), Witkower & Tracy 2019.
"""

from dataclasses import dataclass
from typing import Literal

Anchor = Literal["chest", "shoulder", "room"]
"""What a pose is fixed to: the moving chest, a plumb line from the shoulder, or the room (thighs of a sitting body)."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a hand is, and how it is turned."""

    out: float
    up: float
    fore: float
    elbow: float = 0.0
    palm: float = 10.0
    bend: float = 0.0
    anchor: Anchor = "chest"


@dataclass(frozen=True, slots=True)
class Gesture:
    """A sequence of poses: the first is prepared, the rest are strokes, of which the last `cycle` repeat."""

    poses: tuple[Pose, ...]
    hands: float = 0.4
    """Readiness for both hands: 0 one hand, 1 both."""
    cycle: int = 0
    repeat: tuple[int, int] = (1, 1)
    hold: tuple[float, float] = (0.1, 0.5)  # seconds
    pace: float = 1.0
    """Speed relative to a conversational stroke."""
    touch: bool = False
    """Ends on the body: its size and height are given by the body, not by the mood."""
    shrug: float = 0.0  # m
    head: tuple[float, float, float] = (0.0, 0.0, 0.0)  # deg, down, aside, tilt
    trunk: float = 0.0  # deg, forward


P = Pose

GESTURES: dict[str, Gesture] = {
    # Conversation
    "beat": Gesture((P(0.24, -0.29, 0.30), P(0.26, -0.40, 0.34)), 0.35, cycle=2, repeat=(1, 4)),
    "offer": Gesture((P(0.24, -0.30, 0.38, 0, -60),), 0.45, hold=(0.3, 1.0)),
    "frame": Gesture((P(0.15, -0.25, 0.36, 10, 0),), 1.0, hold=(0.2, 0.8)),
    "sweep": Gesture((P(0.06, -0.25, 0.34), P(0.46, -0.22, 0.28, 5, -20)), 0.2, hold=(0.2, 0.6)),
    "point": Gesture((P(0.20, -0.15, 0.48, 5, 35),), 0.0, hold=(0.3, 0.9)),
    "count": Gesture((P(0.16, -0.20, 0.34, 0, -30), P(0.18, -0.25, 0.37, 0, -30)), 0.0, cycle=2, repeat=(2, 4)),
    "roll": Gesture((P(0.18, -0.27, 0.32), P(0.22, -0.18, 0.38), P(0.26, -0.27, 0.40)), 0.5, cycle=3, repeat=(1, 3)),
    "doubt": Gesture((P(0.36, -0.30, 0.22, 0, -70),), 0.9, hold=(0.3, 0.8), shrug=0.04, head=(0, 0, 7)),
    "tidy": Gesture((P(0.11, 0.10, 0.14, 30),), 0.0, hold=(0.2, 0.8), touch=True),
    "scratch": Gesture((P(0.09, 0.04, 0.03, 40), P(0.10, 0.06, 0.05, 40)), 0.0, cycle=2, repeat=(2, 5), touch=True),
    # Joy
    "open": Gesture(
        (P(0.28, -0.20, 0.34), P(0.56, 0.02, 0.16, 25, -40)), 1.0, hold=(0.3, 1.2), trunk=-4, head=(-6, 0, 0)
    ),
    "arms_up": Gesture(
        (P(0.25, -0.15, 0.30), P(0.34, 0.43, 0.08, 40, 0)), 0.95, hold=(0.3, 1.5), trunk=-5, head=(-8, 0, 0)
    ),
    "pump": Gesture((P(0.25, 0.04, 0.24, 30), P(0.27, 0.35, 0.16, 30)), 0.7, cycle=2, repeat=(2, 4), pace=1.25),
    "clap": Gesture((P(0.17, -0.17, 0.31, 15), P(0.055, -0.17, 0.31, 15)), 1.0, cycle=2, repeat=(3, 8), pace=1.3),
    "yes": Gesture(
        (P(0.24, 0.05, 0.30, 30), P(0.24, -0.30, 0.12, 20)), 0.3, cycle=2, repeat=(1, 2), pace=1.35, trunk=5
    ),
    "heart": Gesture((P(0.05, -0.18, 0.17, 30),), 0.8, hold=(0.6, 1.6), touch=True, head=(0, 0, 6)),
    "wave": Gesture((P(0.38, 0.20, 0.24, 20), P(0.22, 0.23, 0.27, 20)), 0.1, cycle=2, repeat=(3, 6), pace=1.2),
    # Amusement
    "slap": Gesture(
        (P(0.24, -0.25, 0.28, 20), P(0.17, -0.52, 0.36, 10, 60, 0, "room")),
        0.5,
        cycle=2,
        repeat=(1, 3),
        pace=1.4,
        touch=True,
        trunk=14,
    ),
    "belly": Gesture((P(0.02, -0.36, 0.18, 20),), 0.8, hold=(0.8, 2.0), touch=True, trunk=8),
    "giggle": Gesture((P(0.02, 0.06, 0.17, 20, 40),), 0.3, hold=(0.6, 1.8), touch=True, head=(5, 0, 5)),
    "tear": Gesture((P(0.05, 0.16, 0.15, 30), P(0.08, 0.15, 0.15, 30)), 0.2, cycle=2, repeat=(1, 3), touch=True),
    "point_laugh": Gesture((P(0.22, -0.22, 0.32), P(0.18, -0.12, 0.50, 5, 35)), 0.0, cycle=2, repeat=(1, 3), pace=1.2),
    # Anger
    "pound": Gesture(
        (P(0.27, 0.02, 0.26, 35), P(0.23, -0.42, 0.35, 15)),
        0.55,
        cycle=2,
        repeat=(1, 4),
        pace=1.55,
        trunk=5,
        head=(6, 0, 0),
    ),
    "jab": Gesture(
        (P(0.24, -0.14, 0.25, 15, 40), P(0.16, -0.09, 0.51, 10, 45)), 0.0, cycle=2, repeat=(2, 5), pace=1.5, trunk=3
    ),
    "chop": Gesture(
        (P(0.25, -0.04, 0.28, 25, 0), P(0.21, -0.36, 0.40, 5, 0)), 0.4, cycle=2, repeat=(1, 4), pace=1.5, head=(5, 0, 0)
    ),
    "throw_up": Gesture(
        (P(0.26, -0.30, 0.25, 10), P(0.43, 0.15, 0.26, 30, -20)), 0.95, pace=1.45, hold=(0.2, 0.7), head=(-8, 0, 0)
    ),
    "clench": Gesture((P(0.27, -0.44, 0.16, 25, 30),), 1.0, hold=(0.8, 2.2), pace=1.2),
    "shake_fists": Gesture((P(0.23, -0.07, 0.29, 30), P(0.23, -0.14, 0.33, 30)), 0.8, cycle=2, repeat=(3, 7), pace=1.6),
    "brush_off": Gesture(
        (P(0.00, -0.12, 0.30, 20, 40), P(0.52, -0.20, 0.24, 15, 30)), 0.3, pace=1.55, hold=(0.1, 0.4), head=(0, 8, 0)
    ),
    "grip_head": Gesture((P(0.13, 0.20, 0.05, 55, 20),), 1.0, hold=(0.6, 1.6), touch=True, head=(6, 0, 0)),
    # Disgust
    "push_off": Gesture(
        (P(0.18, -0.12, 0.23, 15, 50, -40), P(0.24, -0.06, 0.49, 10, 60, -50)),
        0.6,
        cycle=2,
        repeat=(1, 2),
        pace=1.15,
        hold=(0.3, 1.0),
        head=(0, 14, 0),
        trunk=-5,
    ),
    "flick": Gesture(
        (P(0.10, -0.16, 0.28, 10, 60, 30), P(0.44, -0.20, 0.32, 5, 60, -30)),
        0.1,
        cycle=2,
        repeat=(1, 3),
        pace=1.35,
        head=(0, 10, 0),
    ),
    "nose": Gesture((P(0.02, 0.07, 0.18, 20, 40),), 0.1, hold=(0.6, 1.8), touch=True, head=(0, 12, 4)),
    "shield": Gesture((P(0.08, 0.12, 0.28, 25, 60, -30),), 0.4, hold=(0.6, 1.6), head=(4, 16, 0), trunk=-5),
    "wipe": Gesture((P(0.06, -0.30, 0.27, 15), P(0.10, -0.34, 0.30, 15)), 1.0, cycle=2, repeat=(2, 5), pace=1.1),
    "shake_off": Gesture(
        (P(0.30, -0.26, 0.30, 10, 50, 20), P(0.30, -0.32, 0.30, 10, 50, -30)),
        0.6,
        cycle=2,
        repeat=(3, 6),
        pace=1.7,
        head=(0, 10, 0),
    ),
    # Fear
    "guard": Gesture((P(0.13, 0.00, 0.27, 0, 45, -40),), 1.0, hold=(0.8, 2.6), pace=1.3, trunk=-5, shrug=0.03),
    "guard_high": Gesture(
        (P(0.10, 0.17, 0.22, 5, 45, -30),), 0.95, hold=(0.6, 2.0), pace=1.4, head=(6, 10, 0), trunk=-5, shrug=0.03
    ),
    "clutch": Gesture((P(0.03, -0.13, 0.18, 0),), 1.0, hold=(1.0, 3.0), touch=True, shrug=0.02),
    "gasp": Gesture((P(0.03, 0.06, 0.17, 5, 40),), 0.8, hold=(0.8, 2.2), pace=1.25, touch=True, shrug=0.02),
    "duck": Gesture(
        (P(0.11, 0.30, 0.06, 30, 40),), 1.0, hold=(0.6, 1.8), pace=1.5, touch=True, trunk=12, head=(16, 0, 0)
    ),
    "wring": Gesture(
        (P(0.05, -0.29, 0.24), P(0.07, -0.31, 0.26, 0, -20)), 1.0, cycle=2, repeat=(3, 7), pace=0.9, touch=True
    ),
    "hug": Gesture((P(-0.09, -0.15, 0.18, 5),), 1.0, hold=(1.2, 3.5), touch=True, shrug=0.015),
    # Pride
    "akimbo": Gesture((P(0.21, -0.43, 0.04, 68, 60, -20),), 0.95, hold=(1.5, 4.5), touch=True),
    "cross": Gesture((P(-0.06, -0.24, 0.20, 15),), 1.0, hold=(1.2, 4.0), touch=True),
    "self": Gesture((P(0.05, -0.16, 0.19, 35),), 0.2, hold=(0.6, 1.6), touch=True, head=(-4, 0, 0)),
    "display": Gesture((P(0.46, -0.36, 0.16, 15, -30),), 1.0, hold=(0.6, 1.8), trunk=-4, head=(-5, 0, 0)),
    "fist_up": Gesture((P(0.26, 0.02, 0.22, 30), P(0.31, 0.42, 0.10, 35)), 0.3, hold=(0.6, 1.8), head=(-5, 0, 0)),
    "hands_back": Gesture((P(0.04, -0.48, -0.15, 15, 40),), 1.0, hold=(1.5, 4.0), touch=True),
    # Relief
    "let_go": Gesture(
        (P(0.20, -0.16, 0.24, 10), P(0.25, -0.46, 0.22, 0, -20)),
        0.95,
        hold=(0.3, 1.0),
        pace=0.8,
        trunk=5,
        head=(6, 0, 0),
    ),
    "calm": Gesture((P(0.03, -0.15, 0.18, 15),), 0.3, hold=(0.8, 2.2), touch=True, head=(-6, 0, 4)),
    "brow": Gesture(
        (P(0.04, 0.23, 0.14, 25, 40), P(0.24, 0.21, 0.18, 30, 40)), 0.0, hold=(0.1, 0.4), touch=True, pace=0.9
    ),
    "rub_face": Gesture(
        (P(0.05, 0.17, 0.16, 15, 40), P(0.06, 0.06, 0.17, 10, 40)),
        0.9,
        cycle=2,
        repeat=(1, 2),
        touch=True,
        pace=0.7,
        hold=(0.2, 0.8),
    ),
    "hands_head": Gesture((P(0.12, 0.28, 0.00, 55, 20),), 1.0, hold=(0.6, 2.0), touch=True, trunk=-6, head=(-10, 0, 0)),
    # Sadness
    "cover_face": Gesture(
        (P(0.05, 0.11, 0.16, 5, 40),), 0.95, hold=(1.2, 4.0), touch=True, trunk=6, head=(10, 0, 0), pace=0.9
    ),
    "forehead": Gesture((P(0.05, 0.19, 0.15, 5, 40),), 0.1, hold=(1.0, 3.0), touch=True, head=(10, 0, 4), pace=0.9),
    "wipe_eye": Gesture(
        (P(0.05, 0.14, 0.16, 10, 30), P(0.09, 0.13, 0.15, 10, 30)), 0.1, cycle=2, repeat=(1, 3), touch=True, pace=0.8
    ),
    "helpless": Gesture((P(0.29, -0.42, 0.24, 0, -65),), 1.0, hold=(0.5, 1.5), pace=0.9, head=(0, 0, 6)),
    "neck": Gesture((P(0.06, 0.05, -0.07, 35, 40),), 0.05, hold=(0.8, 2.5), touch=True, head=(8, 5, 0)),
    # Surprise
    "startle": Gesture(
        (P(0.38, 0.02, 0.28, 15, 20, -30),), 1.0, hold=(0.3, 1.2), pace=1.8, trunk=-7, shrug=0.03, head=(-6, 0, 0)
    ),
    "mouth": Gesture((P(0.03, 0.07, 0.17, 10, 40),), 0.75, hold=(0.6, 1.8), pace=1.5, touch=True, trunk=-4),
    "cheeks": Gesture((P(0.09, 0.10, 0.14, 15, 20),), 1.0, hold=(0.6, 1.8), pace=1.4, touch=True),
    "hands_up": Gesture((P(0.30, 0.14, 0.20, 10, 20, -30),), 1.0, hold=(0.3, 1.0), pace=1.7, trunk=-6, shrug=0.03),
}
"""All gestures by name."""
