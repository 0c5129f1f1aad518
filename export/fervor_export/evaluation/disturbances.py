"""The same movement, seen otherwise: another body, another place of the sensor, other rates, lost frames, a lost arm.

Every disturbance goes the way that a live body's poses go: what a sensor would send is rendered from the clip, and the
adapter makes poses of it again. Lost and in-between frames are filled as the session does (docs, "A live body"): SLERP
over gaps up to `INTERPOLATE_S`; over longer ones the old pose is held, unobserved.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, from_euler, multiply, rotate, slerp
from fervor.skeletons.adapter import adapt
from fervor.skeletons.catalog import skeleton
from fervor.skeletons.landmarks import LANDMARKS, POINTS
from fervor.skeletons.positions import local_over_time
from fervor.skeletons.rig import JOINTS, SEGMENTS, mirror_pose
from fervor.skeletons.standard_body import points, segments
from fervor_export.clip import RATE_HZ
from fervor_export.evaluation.estimator import Motion

Floats = npt.NDArray[np.float64]
See = Callable[[Motion, np.random.Generator], Motion]

INTERPOLATE_S = 0.25
"""Longest gap that is bridged by SLERP; the session's own, as a test holds."""

ARM = tuple(JOINTS.index(name) for name in ("l_shoulder", "l_elbow", "l_wrist"))

SENSOR, LANDMARK_SENSOR = "kinect_v2", "mediapipe"
"""A sensor that sends rotations in camera axes, and one that sends points."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One way of seeing otherwise."""

    name: str
    title: str
    apply: See
    exact: bool = False
    """Whether estimates must stay the same, to rounding."""
    against: See | None = None
    """What it is compared with, where that is not the clip itself: the same kind of sensor, undisturbed."""


def from_points(
    motion: Motion,
    *,
    scale: float = 1.0,
    bones: Mapping[str, float] = MappingProxyType({}),
    camera: Floats = IDENTITY,
) -> Motion:
    """Seen by a landmark sensor: points of a standard body, turned and moved, made rotations again."""
    landmarks = LANDMARKS[LANDMARK_SENSOR]
    body = points(motion.rotations, scale=scale, bones=bones)
    sent = np.zeros((len(motion), len(landmarks.joints), 3))
    for point in POINTS:
        if point in landmarks.points:
            sent[:, landmarks.points[point]] = body[point]
    away = np.array([0.4, -0.2, 2.5])
    local, seen = local_over_time(landmarks, rotate(camera, sent) + away, np.ones(sent.shape[:2], bool))
    return Motion(local.astype(np.float32), seen & motion.mask)


def from_camera(motion: Motion, camera: Floats) -> Motion:
    """Seen by a sensor that sends each joint's rotation in its own axes, from wherever it stands."""
    source = skeleton(SENSOR)
    whole = segments(motion.rotations)
    sent = np.tile(IDENTITY, (len(motion), len(source.joints), 1))
    for index, (name, drive) in enumerate(zip(SEGMENTS, source.drives, strict=True)):
        if drive is not None and drive >= 0:
            sent[:, drive] = multiply(camera, multiply(whole[name], source.bind[index]))
    local, seen = adapt(source, sent, np.ones(sent.shape[:2], bool), axes="global")
    return Motion(local.astype(np.float32), seen & motion.mask)


def mirrored(motion: Motion) -> Motion:
    """Left and right exchanged."""
    return Motion(*mirror_pose(motion.rotations, motion.mask))


def armless(motion: Motion) -> Motion:
    """The left arm never seen."""
    rotations, mask = motion.rotations.copy(), motion.mask.copy()
    rotations[:, ARM], mask[:, ARM] = IDENTITY, False
    return Motion(rotations, mask)


def at_rate(motion: Motion, rate_hz: float) -> Motion:
    """Streamed at another rate; a faster stream's first frame lies between two of the clip, so all of them do."""
    times = np.arange(len(motion)) / RATE_HZ
    start = 0.0 if rate_hz <= RATE_HZ else 1.0 / rate_hz
    sent = np.arange(start, times[-1] + 1e-9, 1.0 / rate_hz)
    return regrid(_at(motion, times, sent), sent) if len(sent) else motion


def with_lost_frames(motion: Motion, share: float, random: np.random.Generator) -> Motion:
    """With a share of the frames lost, the first one never."""
    kept = np.flatnonzero(random.random(len(motion)) >= share)
    kept = np.union1d(0, kept)
    return regrid(Motion(motion.rotations[kept], motion.mask[kept]), kept / RATE_HZ)


def regrid(motion: Motion, times: Floats) -> Motion:
    """Poses at rising times [frame] in seconds, put on the 30 Hz grid that the first of them sets."""
    grid = times[0] + np.arange(int(np.floor((times[-1] - times[0]) * RATE_HZ + 1e-6)) + 1) / RATE_HZ
    return _at(motion, times, grid)


def _at(motion: Motion, times: Floats, wanted: Floats) -> Motion:
    """Poses at `wanted` times, all within `times`."""
    after = np.searchsorted(times, wanted - 1e-6).clip(0, len(times) - 1)
    before = np.maximum(after - 1, 0)
    gap = times[after] - times[before]
    fraction = np.where(gap > 0, (wanted - times[before]) / np.where(gap > 0, gap, 1.0), 1.0)
    fraction = np.where(np.abs(times[after] - wanted) < 1e-6, 1.0, fraction)
    held = (gap > INTERPOLATE_S + 1e-6) & (fraction < 1.0)
    rotations, mask = _held(motion)
    way = slerp(rotations[before], rotations[after], fraction[:, None].astype(np.float32))
    seen = np.where(fraction[:, None] >= 1.0, mask[after], mask[after] & mask[before]) & ~held[:, None]
    return Motion(np.where(held[:, None, None], rotations[before], way), seen)


def _held(motion: Motion) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """Joints that are not observed keep the rotation they had; the identity before the first."""
    place = np.maximum.accumulate(np.where(motion.mask, np.arange(len(motion))[:, None], -1), axis=0)
    kept = np.take_along_axis(motion.rotations, np.maximum(place, 0)[..., None], axis=0)
    return np.where((place < 0)[..., None], IDENTITY.astype(np.float32), kept), motion.mask


@cache
def disturbances() -> tuple[Disturbance, ...]:
    """All of them, in the order of the report."""
    turned = from_euler("YX", np.array([150.0, 20.0]))
    return (
        *_sizes(),
        Disturbance(
            "camera_points",
            "camera turned, points",
            lambda motion, _: from_points(motion, camera=turned),
            exact=True,
            against=_points,
        ),
        Disturbance(
            "camera_rotations", "camera turned, rotations", lambda motion, _: from_camera(motion, turned), exact=True
        ),
        Disturbance("mirror", "mirrored", lambda motion, _: mirrored(motion)),
        *(_rate(rate_hz) for rate_hz in (15.0, 30.0, 60.0, 120.0)),
        Disturbance(
            "lost_frames",
            "30 % of the frames lost",
            lambda motion, random: with_lost_frames(motion, 0.3, random),
        ),
        Disturbance("one_arm", "one arm unseen", lambda motion, _: armless(motion)),
    )


def _sizes() -> list[Disturbance]:
    """Other bodies."""
    made = []
    for name, parts in (("all bones", ()), ("arms", ("elbow", "wrist")), ("legs", ("knee", "ankle"))):
        for factor in (0.7, 1.3):
            see = _bones(dict.fromkeys(parts, factor)) if parts else _scale(factor)
            key = f"{name.replace(' ', '_')}_{factor:g}"
            made.append(Disturbance(key, f"{name} {100 * (factor - 1):+.0f} %", see, exact=True, against=_points))
    return made


def _scale(factor: float) -> See:
    return lambda motion, _: from_points(motion, scale=factor)


def _bones(factors: Mapping[str, float]) -> See:
    return lambda motion, _: from_points(motion, bones=factors)


def _points(motion: Motion, _: np.random.Generator) -> Motion:
    return from_points(motion)


def _rate(rate_hz: float) -> Disturbance:
    return Disturbance(
        f"rate_{rate_hz:g}", f"{rate_hz:g} Hz", lambda motion, _: at_rate(motion, rate_hz), exact=rate_hz == RATE_HZ
    )
