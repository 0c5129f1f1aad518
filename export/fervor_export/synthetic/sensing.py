"""What a sensor makes of a motion: offsets of its zero pose, lag, jitter, frozen and missing joints.

A clean motion comes in, rotations and a mask go out; nothing here knows of emotions. A missing joint holds its last
pose with mask 0, as the service does with live bodies. Sizes are of the order of what is reported for inertial suits
(a few degrees and slow drift), Kinect v2 (5-15° of offset, degrees of jitter, worst at wrists and forearm roll) and
landmark models, whose absolute angles differ from a suit's by tens of degrees while their changes agree.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fervor import rotations
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS

Array = npt.NDArray[np.float64]
Kind = Literal["optical", "suit", "depth", "landmarks"]

KINDS: dict[Kind, float] = {"optical": 0.30, "suit": 0.30, "depth": 0.24, "landmarks": 0.16}
"""How often each kind of sensor is drawn."""


SPINE_SHARE = (0.25, 0.85)
"""What part of a bent trunk a skeleton's lower joint has: they cut spines in different places."""


@dataclass(frozen=True, slots=True)
class Quality:
    """Ranges from which a sensor's flaws are drawn, in degrees unless said otherwise."""

    offset: tuple[float, float]  # constant misalignment of segments, standard deviation
    offset_share: float  # share of clips that have one
    jitter: tuple[float, float]  # frame-to-frame noise
    drift: tuple[float, float]  # slow wandering
    lag: tuple[float, float]  # seconds, time constant of the sensor's filter
    loses: float  # expected stretches of a lost joint per ten seconds
    no_legs: float  # share of clips
    no_wrists: float  # share of clips


QUALITY: dict[Kind, Quality] = {
    "optical": Quality((3.0, 10.0), 0.3, (0.0, 0.25), (0.0, 0.3), (0.0, 0.0), 0.0, 0.25, 0.10),
    "suit": Quality((4.0, 12.0), 0.4, (0.05, 0.4), (0.3, 2.5), (0.0, 0.02), 0.0, 0.30, 0.05),
    "depth": Quality((5.0, 18.0), 0.6, (0.5, 3.0), (0.3, 2.0), (0.02, 0.09), 1.2, 0.40, 0.35),
    "landmarks": Quality((10.0, 25.0), 0.8, (0.3, 2.0), (0.3, 2.0), (0.01, 0.07), 0.8, 0.45, 0.60),
}

_WRISTS = tuple(JOINTS.index(name) for name in ("l_wrist", "r_wrist"))
_ELBOWS = tuple(JOINTS.index(name) for name in ("l_elbow", "r_elbow"))
_LEGS = tuple(JOINTS.index(name) for name in ("l_hip", "l_knee", "r_hip", "r_knee"))
_TRUNK = tuple(JOINTS.index(name) for name in ("spine", "chest"))
_SHAKY = np.ones(len(JOINTS))
_SHAKY[list(_WRISTS)], _SHAKY[list(_ELBOWS)], _SHAKY[list(_TRUNK)], _SHAKY[2] = 2.2, 1.4, 0.5, 0.8


def sense(rng: np.random.Generator, motion: Array, kind: Kind | None = None) -> tuple[Array, npt.NDArray[np.bool_]]:
    """A motion as a sensor at 30 Hz would report it.

    Args:
        rng: where chance comes from.
        motion: clean local rotations [frame, 13, 4] xyzw.
        kind: kind of sensor; drawn if absent.

    Returns:
        Rotations [frame, 13, 4] and mask [frame, 13], True where observed.
    """
    kinds = list(KINDS)
    kind = kind or kinds[int(rng.choice(len(kinds), p=list(KINDS.values())))]
    quality = QUALITY[kind]
    seen = respine(motion, rng.uniform(*SPINE_SHARE)) if rng.random() < 0.3 else motion
    if kind == "landmarks":
        seen = _without_roll(seen)
    elif rng.random() < 0.25:
        seen = roll_in_wrists(seen)
    if rng.random() < quality.offset_share:
        seen = misalign(seen, rng, rng.uniform(*quality.offset))
    seen = smooth(seen, rng.uniform(*quality.lag))
    seen = _shake(seen, rng, rng.uniform(*quality.jitter), rng.uniform(*quality.drift))
    mask = _lose(rng, len(seen), quality)
    return hold(_freeze(seen, rng) if rng.random() < 0.04 else seen, mask), mask


def respine(motion: Array, share: float) -> Array:
    """The motion of a skeleton that bends a share of the whole trunk in its lower, the rest in its upper joint."""
    out = motion.copy()
    whole = rotations.multiply(motion[:, 0], motion[:, 1])  # [frame, 4] pelvis to thorax
    out[:, 0] = rotations.from_rotvec(share * rotations.to_rotvec(whole))
    out[:, 1] = rotations.multiply(rotations.conjugate(out[:, 0]), whole)
    return out


def roll_in_wrists(motion: Array) -> Array:
    """Pronation as a turn of the hand instead of the forearm: skeletons differ in where they have it."""
    out = _without_roll(motion)
    for elbow, wrist in zip(_ELBOWS, _WRISTS, strict=True):
        twist = rotations.multiply(rotations.conjugate(out[:, elbow]), motion[:, elbow])
        out[:, wrist] = rotations.multiply(twist, motion[:, wrist])
    return out


def misalign(motion: Array, rng: np.random.Generator, degrees: float) -> Array:
    """The motion of a sensor whose segments sit askew by constant rotations A: A_parent · L · A_child⁻¹."""
    askew = rotations.from_rotvec(rng.normal(0.0, np.radians(degrees) / np.sqrt(3.0), (len(SEGMENTS), 3)))
    parents, children = askew[list(PARENT_SEGMENT)], askew[list(CHILD_SEGMENT)]
    return rotations.multiply(rotations.multiply(parents, motion), rotations.conjugate(children))


def smooth(motion: Array, seconds: float, rate_hz: float = 30.0) -> Array:
    """A first-order low-pass with a time constant in seconds: what a tracker's filter does, lag included."""
    if seconds <= 0.0:
        return motion
    keep = float(np.exp(-1.0 / (seconds * rate_hz)))
    aligned = continuous(motion)
    out = np.empty_like(aligned)
    out[0] = aligned[0]
    for frame in range(1, len(aligned)):
        out[frame] = keep * out[frame - 1] + (1.0 - keep) * aligned[frame]
    return rotations.normalise(out)


def continuous(motion: Array) -> Array:
    """The same rotations [frame, ..., 4] with signs that never flip between frames."""
    turned = (motion[1:] * motion[:-1]).sum(axis=-1) < 0.0
    sign = np.cumprod(np.where(turned, -1.0, 1.0), axis=0)[..., None]
    return np.concatenate((motion[:1], motion[1:] * sign))


def hold(motion: Array, mask: npt.NDArray[np.bool_]) -> Array:
    """Rotations [frame, joint, 4] where a masked joint keeps the pose it was last seen in (identity if never)."""
    frames = np.arange(len(motion))[:, None]
    last = np.maximum.accumulate(np.where(mask, frames, -1), axis=0)  # [frame, joint]
    held = np.take_along_axis(motion, np.maximum(last, 0)[..., None], axis=0)
    return np.where(last[..., None] < 0, rotations.IDENTITY, held)


def _without_roll(motion: Array) -> Array:
    """Forearms without pronation: landmarks show where a bone points, not how it is turned about itself."""
    out = motion.copy()
    for joint in _ELBOWS:
        twist = motion[:, joint] * np.array([0.0, 1.0, 0.0, 1.0])
        out[:, joint] = rotations.multiply(motion[:, joint], rotations.conjugate(rotations.normalise(twist)))
    return out


def _shake(motion: Array, rng: np.random.Generator, jitter: float, drift: float) -> Array:
    """Frame noise (partly correlated, as filters leave it) and slow drift added to every joint."""
    frames = len(motion)
    white = rng.normal(size=(frames + 1, len(JOINTS), 3))
    noise = 0.8 * white[1:] + 0.6 * white[:-1]
    knots = rng.normal(size=(frames // 60 + 3, len(JOINTS), 3))
    place = np.arange(frames) / 60.0
    low = place.astype(int)
    share = (place - low)[:, None, None]
    wander = knots[low] * (1.0 - share) + knots[low + 1] * share
    degrees = (jitter * noise * _SHAKY[:, None] + drift * wander) / np.sqrt(3.0)
    return rotations.multiply(motion, rotations.from_rotvec(np.radians(degrees)))


def _lose(rng: np.random.Generator, frames: int, quality: Quality) -> npt.NDArray[np.bool_]:
    """Which joints are observed when [frame, 13]."""
    mask = np.ones((frames, len(JOINTS)), bool)
    if rng.random() < quality.no_legs:
        mask[:, _LEGS] = False
    if rng.random() < quality.no_wrists:
        mask[:, _WRISTS] = False
    if rng.random() < 0.05:  # a sensor without a waist, like OpenNI's
        mask[:, _TRUNK] = False
    for _ in range(rng.poisson(quality.loses * frames / 300.0)):
        first, length = int(rng.integers(0, frames)), int(rng.integers(3, 45))
        joints = rng.choice(len(JOINTS), size=int(rng.integers(1, 4)), replace=False)
        mask[first : first + length, joints] = False
    return mask


def _freeze(motion: Array, rng: np.random.Generator) -> Array:
    """A joint that its sensor reports as observed but that stands still for a while."""
    frames, joint = len(motion), int(rng.integers(len(JOINTS)))
    first = int(rng.integers(0, frames))
    stuck = np.ones((frames, len(JOINTS)), bool)
    stuck[first + 1 : first + int(rng.integers(15, 120)), joint] = False
    return hold(motion, stuck)
