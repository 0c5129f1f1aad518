"""A motion file as clips need it: its phases at 30 Hz, without a T-pose at its beginning, and its fingerprints.

Rules. A recording of 120 Hz has four phases at 30 Hz, each begun 1/120 s after the other (Sun et al., section IV-B);
one of 60 Hz has two. The software that writes BVH may begin it with a T-pose: it is dropped where it is one, that is
where arms are out and straight and the body could not have left it in one frame. A fingerprint is a number that a
pose of the upper body shares with its copies and nothing else; it is taken at the file's own rate.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fervor.errors import DataError
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor.rotations import angle_between, from_axis_angle
from fervor.skeletons.rig import JOINTS, MIRROR, UPPER_BODY
from fervor_export.clip import RATE_HZ, Phase
from fervor_export.data.bones import bones_of
from fervor_export.data.resample import on_grid, without_jumps

MOST_PHASES = 4

LEAST_S = 0.5
"""Recordings shorter than this are no motion that anybody could judge."""

LEAST_HZ = 5.0
"""With fewer frames a second there would be gaps alone; files have been seen with a frame time in milliseconds."""

T_POSE_ARM_DEG, T_POSE_REST_DEG = 12.0, 25.0
"""How far arms, and trunk and head, may be from a T-pose: files have been seen with a bent neck in it."""

LEAVING_DEG_S = 2000.0
"""No joint of a person turns faster than this; a body that leaves a T-pose faster was never in it."""

QUANTUM = 500.0
"""Fingerprints are of quaternions in steps of 1/500: 0.2°."""

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Prints = npt.NDArray[np.uint64]

_OUT = {joint: from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(math.radians(turn)))
        for joint, turn in (("l_shoulder", 90.0), ("r_shoulder", -90.0))}  # fmt: skip
_T_POSE = np.stack([_OUT.get(joint, np.array([0.0, 0.0, 0.0, 1.0])) for joint in JOINTS])[list(UPPER_BODY)]
_ARMS = np.array([JOINTS[joint][:2] in ("l_", "r_") for joint in UPPER_BODY])
_TOLERANCE = np.radians(np.where(_ARMS, T_POSE_ARM_DEG, T_POSE_REST_DEG))
_FACTORS = (np.arange(1, 1 + 4 * len(UPPER_BODY), dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)) ^ np.uint64(
    0xBF58476D1CE4E5B9
)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What a file, or a stretch of one, holds."""

    phases: tuple[Phase, ...]
    """At least one; the first begins with the recording."""
    prints: Prints  # [pose] of the poses
    mirrored: Prints  # [pose] of the poses as a mirror shows them
    poses: int
    rate_hz: float
    seconds: float
    skeleton: str
    """For people."""
    t_poses: int
    """Frames dropped at the beginning."""
    doubt: str
    """What is odd about it; empty where nothing is."""
    bones: str = ""
    """What files with equal bones share; empty where the kind of file brings none."""


def read_motion(
    file: Path, *, skeleton: str | None = None, start_s: float | None = None, end_s: float | None = None
) -> Motion:
    """The motion in a file.

    Args:
        file: BVH, MVNX, CSV, JSONL or NPZ.
        skeleton: for tables that name none.
        start_s: where the stretch begins, in the file's own time.
        end_s: where it ends.

    Raises:
        RecordingError: the file can't be read as a recording.
        DataError: it can, but is too short, or shows no upper body.
    """
    recording = read_recording(file, skeleton=skeleton)
    times, local, observed = rig_poses(recording)
    if recording.skeleton.noisy:
        observed = without_jumps(local, observed)
    t_poses, doubt = count_t_poses(times, local, observed) if file.suffix.lower() == ".bvh" else (0, "")
    kept = _stretch(times, t_poses, start_s, end_s)
    times, local, observed = times[kept], local[kept], observed[kept]
    rate = _rate(times)
    _check(times, observed)
    return Motion(
        phases=phases(times, local, observed, rate),
        prints=fingerprints(local, observed),
        mirrored=fingerprints(local[:, list(MIRROR)], observed[:, list(MIRROR)]),
        poses=len(times),
        rate_hz=rate,
        seconds=float(times[-1] - times[0]),
        skeleton=recording.skeleton.title,
        t_poses=t_poses,
        doubt=doubt or _oddity(times, local, observed),
        bones=bones_of(file),
    )


def phases(times: Floats, local: Floats, observed: Mask, rate_hz: float) -> tuple[Phase, ...]:
    """As many phases at 30 Hz as the rate has, up to `MOST_PHASES`."""
    count = min(max(int(rate_hz / RATE_HZ + 0.02), 1), MOST_PHASES)
    return tuple(Phase(*on_grid(times, local, observed, phase_s=index / (count * RATE_HZ))) for index in range(count))


def count_t_poses(times: Floats, local: Floats, observed: Mask) -> tuple[int, str]:
    """How many frames at the beginning are a T-pose that software put there, and a doubt where that is not clear."""
    upper, seen = local[:, UPPER_BODY], observed[:, UPPER_BODY]
    out = (angle_between(upper[:1], _T_POSE) < _TOLERANCE) | ~seen[:1]
    if len(times) < 2 or not out.all() or not seen[0, _ARMS].any():
        return 0, ""
    still = angle_between(upper[1:], upper[:1]).max(axis=1, where=seen[1:] & seen[:1], initial=0.0) < 1e-4
    count = 1 + (len(still) if still.all() else int(still.argmin()))
    if count == len(times):
        return 0, "it is a T-pose from beginning to end"
    turned = angle_between(upper[count], upper[count - 1])[seen[count] & seen[count - 1]].max(initial=0.0)
    if turned > np.radians(LEAVING_DEG_S) * (times[count] - times[count - 1]):
        return count, ""
    return 0, "it begins in a T-pose and moves on from it, so that was kept"


def fingerprints(local: Floats, observed: Mask) -> Prints:
    """A number [pose] for each pose of the upper body; unseen joints count as the same everywhere."""
    upper, seen = local[:, UPPER_BODY], observed[:, UPPER_BODY]
    steps = np.rint(np.abs(upper) * QUANTUM) * seen[..., None]  # q and -q are one rotation, and so is a mirror's
    prints: Prints = (steps.reshape(len(steps), -1).astype(np.uint64) * _FACTORS).sum(axis=1, dtype=np.uint64)
    return prints


def _stretch(times: Floats, t_poses: int, start_s: float | None, end_s: float | None) -> Mask:
    """Which poses [pose] belong to the stretch."""
    kept = np.ones(len(times), np.bool_)
    kept[:t_poses] = False
    last = float(times[-1])
    if start_s is not None and start_s >= last:
        raise DataError(f"it is {last:.2f} s long; a start at {start_s:g} s lies behind its end")
    if end_s is not None and end_s > last + 0.1:
        raise DataError(f"it is {last:.2f} s long; an end at {end_s:g} s lies behind its end")
    kept &= times >= (start_s or 0.0) - 1e-6
    kept &= times <= (math.inf if end_s is None else end_s) + 1e-6
    return kept


def _rate(times: Floats) -> float:
    return float(1.0 / np.median(np.diff(times))) if len(times) > 1 else 0.0


def _check(times: Floats, observed: Mask) -> None:
    seconds = float(times[-1] - times[0]) if len(times) else 0.0
    if 0.0 < _rate(times) < LEAST_HZ:
        raise DataError(f"it has {_rate(times):.2g} frames a second; expected {LEAST_HZ:g} or more, times in seconds")
    if seconds < LEAST_S:
        raise DataError(f"{seconds:.2f} s of motion are too short; expected {LEAST_S:g} s or more")
    if not observed[:, UPPER_BODY].any():
        raise DataError("no joint of the upper body is ever seen")


def _oddity(times: Floats, local: Floats, observed: Mask) -> str:
    """What makes a recording look wrong, though it can be read."""
    moved = angle_between(local[1:], local[:-1]).max(initial=0.0, where=observed[1:] & observed[:-1])
    if moved < 1e-4:
        return "nothing moves in it"
    if (gap := float(np.diff(times).max())) > 1.0:
        return f"nothing was recorded for {gap:.1f} s"
    if _rate(times) < 0.75 * RATE_HZ:
        return f"it has {_rate(times):.1f} frames a second; estimates are trained at {RATE_HZ:g}"
    share = float(observed[:, UPPER_BODY].mean())
    return f"{share:.0%} of the upper body is seen" if share < 0.6 else ""
