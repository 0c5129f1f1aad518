"""The channels through which a body shows an emotion, and the arithmetic on their values.

Channel values are arrays [..., channel] in the order of `CHANNELS`. Between weak and strong a value runs straight,
multipliers in the logarithm. `table` says which values belong to which emotion.
"""

from dataclasses import dataclass

import numpy as np

from fervor_export.synthetic.table import TABLE
from fervor_export.synthetic.tracks import Array


@dataclass(frozen=True, slots=True)
class Channel:
    """One way in which a body shows something."""

    name: str
    neutral: float
    unit: str
    notice: float
    """A difference that a viewer just takes notice of: the yardstick for weighing channels against each other."""
    low: float
    high: float
    ratio: bool = False
    """Whether the value is a multiplier."""
    seen_in: str = "posture"
    """`posture`: always; `gesture`: while the arms gesture; `gait`: while walking; `rhythm`: always."""


CHANNELS: tuple[Channel, ...] = (
    Channel("slump", 0.0, "deg, bent thorax; negative: chest out", 7.0, -22.0, 45.0),
    Channel("lean", 0.0, "deg, trunk forward", 6.0, -25.0, 30.0),
    Channel("head", 0.0, "deg, head down", 8.0, -32.0, 48.0),
    Channel("aside", 4.0, "deg, head turned away", 10.0, 0.0, 60.0),
    Channel("tilt", 3.0, "deg, head to one side", 6.0, 0.0, 25.0),
    Channel("shrug", 0.0, "m, shoulders raised", 0.02, -0.03, 0.09),
    Channel("reach", 1.0, "x, size of gestures", 0.20, 0.35, 2.2, ratio=True, seen_in="gesture"),
    Channel("height", 0.0, "m, gestures raised", 0.09, -0.2, 0.4, seen_in="gesture"),
    Channel("width", 0.0, "deg, elbows out", 14.0, -30.0, 60.0, seen_in="gesture"),
    Channel("tempo", 1.0, "x, speed of strokes", 0.17, 0.4, 2.6, ratio=True, seen_in="gesture"),
    Channel("rate", 0.4, "gestures a second", 0.40, 0.05, 1.3, ratio=True, seen_in="gesture"),
    Channel("jerk", 0.2, "0..1, abruptness", 0.28, 0.0, 1.0, seen_in="gesture"),
    Channel("hold", 1.0, "x, length of holds", 0.45, 0.3, 4.0, ratio=True, seen_in="gesture"),
    Channel("emblem", 0.0, "share of gestures that are this emotion's own", 0.30, 0.0, 1.0, seen_in="gesture"),
    Channel("trunk", 0.35, "0..1, trunk follows the arms", 0.35, 0.0, 1.4, seen_in="gesture"),
    Channel("bounce", 0.0, "deg, rhythm of knees and trunk", 2.0, 0.0, 9.0, seen_in="rhythm"),
    Channel("laugh", 0.0, "share of time spent laughing", 0.25, 0.0, 1.0, seen_in="rhythm"),
    Channel("tremble", 0.0, "deg, tremor of the arms", 0.8, 0.0, 5.0, seen_in="rhythm"),
    Channel("sway", 1.0, "x, unrest of the trunk", 0.35, 0.3, 3.0, ratio=True, seen_in="rhythm"),
    Channel("breath", 1.0, "x, depth of breathing", 0.45, 0.5, 4.0, ratio=True, seen_in="rhythm"),
    Channel("nod", 1.0, "x, movement of the head", 0.40, 0.2, 3.5, ratio=True, seen_in="rhythm"),
    Channel("start", 0.0, "0..1, startle or recoil", 0.25, 0.0, 1.5, seen_in="rhythm"),
    Channel("swing", 1.0, "x, arm swing", 0.25, 0.15, 2.2, ratio=True, seen_in="gait"),
    Channel("cadence", 1.0, "x, steps a second", 0.07, 0.65, 1.5, ratio=True, seen_in="gait"),
    Channel("stride", 1.0, "x, length of steps", 0.09, 0.5, 1.5, ratio=True, seen_in="gait"),
)
"""Order of the channel axis."""

INDEX = {channel.name: index for index, channel in enumerate(CHANNELS)}

NEUTRAL: Array = np.array([channel.neutral for channel in CHANNELS])
_RATIO = np.array([channel.ratio for channel in CHANNELS])
_LOW = np.array([channel.low for channel in CHANNELS])
_HIGH = np.array([channel.high for channel in CHANNELS])
_NOTICE = np.array([channel.notice for channel in CHANNELS])
SEEN_IN: tuple[str, ...] = tuple(channel.seen_in for channel in CHANNELS)


def bounds(emotion: str) -> tuple[Array, Array, Array]:
    """The table's row as arrays [channel]: weak, strong, spread."""
    weak, strong, spread = NEUTRAL.copy(), NEUTRAL.copy(), np.zeros(len(CHANNELS))
    for name, entry in TABLE[emotion].items():
        weak[INDEX[name]], strong[INDEX[name]], spread[INDEX[name]] = entry
    return weak, strong, spread


def blend(weak: Array, strong: Array, intensity: Array) -> Array:
    """Channel values [..., channel] between weak and strong [channel] at an intensity [..., channel], kept in range."""
    share = np.clip(intensity, -0.3, 1.4)
    straight = weak + share * (strong - weak)
    safe_weak, safe_strong = np.where(_RATIO, weak, 1.0), np.where(_RATIO, np.maximum(strong, 0.05), 1.0)
    curved = safe_weak * (safe_strong / safe_weak) ** share
    return np.clip(np.where(_RATIO, curved, straight), _LOW, _HIGH)


def distance(weak: Array, value: Array) -> Array:
    """How far `value` lies from `weak`, both [..., channel], in units that a viewer just notices, signed."""
    ratio = np.log(np.where(_RATIO, value, 1.0)) - np.log(np.where(_RATIO, weak, 1.0))
    noticed: Array = np.where(_RATIO, ratio / np.log1p(_NOTICE), (value - weak) / _NOTICE)
    return noticed
