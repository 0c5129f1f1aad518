"""Which gestures and resting poses an emotion uses, and how often; names are those of `gestures`."""

from fervor_export.synthetic.gestures import Pose

P = Pose

# fmt: off
CONVERSATION: dict[str, float] = {
    "beat": 4, "offer": 2, "frame": 1.5, "sweep": 1.2, "point": 0.8, "count": 0.7, "roll": 1, "doubt": 0.7,
    "tidy": 0.4, "scratch": 0.3,
}
"""Gestures of plain talk and how frequent they are; every emotion mixes them in."""

REPERTOIRE: dict[str, dict[str, float]] = {
    "neutral": {},
    "joy": {"open": 2, "arms_up": 2, "pump": 1.3, "clap": 1.5, "yes": 1, "heart": 0.6, "wave": 0.6},
    "amusement": {
        "slap": 1.3, "belly": 1.2, "giggle": 1.3, "tear": 0.5, "clap": 0.8, "point_laugh": 0.8, "rub_face": 0.3,
    },
    "anger": {
        "pound": 1.8, "jab": 1.6, "chop": 1.3, "throw_up": 1, "clench": 0.9, "shake_fists": 1, "brush_off": 0.8,
        "akimbo": 0.4, "cross": 0.3, "grip_head": 0.3,
    },
    "disgust": {"push_off": 1.6, "flick": 1.2, "nose": 1.2, "shield": 1, "wipe": 0.7, "shake_off": 0.9},
    "fear": {
        "guard": 1.6, "guard_high": 1.1, "clutch": 1.2, "gasp": 1, "duck": 0.7, "wring": 0.7, "hug": 0.8,
        "push_off": 0.5,
    },
    "pride": {
        "akimbo": 1.7, "cross": 0.9, "self": 0.9, "display": 1.2, "fist_up": 0.8, "hands_back": 0.6,
        "arms_up": 0.3,
    },
    "relief": {"let_go": 1.8, "calm": 1.2, "brow": 0.9, "rub_face": 0.7, "hands_head": 0.6, "helpless": 0.2},
    "sadness": {
        "cover_face": 1.3, "forehead": 1.2, "wipe_eye": 0.8, "helpless": 0.8, "hug": 0.8, "wring": 0.5,
        "neck": 0.3,
    },
    "shame": {"cover_face": 1.2, "forehead": 0.9, "neck": 1.1, "wring": 0.7, "hug": 1, "shield": 0.4, "clutch": 0.4},
    "surprise": {
        "startle": 1.6, "mouth": 1.1, "cheeks": 0.7, "hands_up": 1.3, "hands_head": 0.4, "self": 0.3, "gasp": 0.4,
    },
}
# fmt: on
"""The gestures of an emotion that is strongly shown, and how frequent they are."""

REST: dict[str, Pose] = {
    "hang": P(0.0, 0.0, 0.0, 0, 0, 0, "shoulder"),
    "clasp": P(0.03, -0.44, 0.20, 5, 10),
    "crossed": P(-0.06, -0.25, 0.20, 15),
    "pockets": P(0.22, -0.46, 0.05, 30, 20),
    "behind": P(0.04, -0.48, -0.15, 15, 40),
    "thighs": P(0.15, -0.53, 0.33, 10, 60, 0, "room"),
    "lap": P(0.03, -0.50, 0.26, 5, 40, 0, "room"),
    "ready": P(0.12, -0.33, 0.28, 5, 20),
}
"""Where hands are when they do nothing."""

RESTING: dict[str, dict[str, float]] = {
    "stand": {"hang": 5, "clasp": 1.2, "crossed": 0.5, "pockets": 0.5, "behind": 0.4, "ready": 0.6},
    "sit": {"thighs": 3, "lap": 2, "crossed": 0.4, "hang": 0.3, "ready": 0.5},
    "walk": {"hang": 8, "clasp": 0.3, "crossed": 0.2, "pockets": 0.3},
}
"""Posture → resting pose → how frequent it is."""

MOOD_OF_REST: dict[str, dict[str, float]] = {
    "sadness": {"hang": 2, "lap": 2, "crossed": 1},
    "shame": {"clasp": 4, "lap": 3, "crossed": 1.5, "behind": 1.5},
    "fear": {"ready": 5, "crossed": 2, "clasp": 2},
    "pride": {"behind": 3, "crossed": 2, "hang": 1.2},
    "anger": {"ready": 2, "crossed": 2, "hang": 1.2},
    "joy": {"ready": 1.5, "hang": 1.2},
}
"""Emotion → resting pose → x, how much it is preferred at intensity 1."""
