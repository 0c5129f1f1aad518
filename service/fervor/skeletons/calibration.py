"""Bind alignment from a held pose, for sensors whose conventions nobody wrote down (formula 4).

A person holds a known pose for a second. With the mean orientation Q_ref of each segment in the sensor's axes and U,
the person's left, up and forward in them, the alignment is A_j = T_j^-1 · U^T · Q_ref: exact, whatever the sensor's
joint axes are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError
from fervor.rotations import IDENTITY, angle_between, conjugate, from_matrix, mean, multiply, normalise
from fervor.skeletons.binds import T_POSE, Quaternion
from fervor.skeletons.rig import SEGMENTS
from fervor.skeletons.skeleton import ROOT, Axes, Skeleton

HeldPose = Literal["n", "t"]
"""`n`: arms hanging, palms to the thighs; `t`: arms straight out to the sides, palms down."""

POSES: Mapping[HeldPose, Mapping[str, Quaternion]] = {"n": {}, "t": T_POSE}
"""T_j of the segments that a pose turns."""

STILL_RAD = float(np.radians(15.0))
"""How far a joint may stray from its mean in a pose that counts as held."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """What a held pose told."""

    skeleton: Skeleton
    """As before, with the alignment found."""
    frames: int
    spread_deg: float
    """Largest deviation of any segment from its mean, degrees."""
    unseen: tuple[str, ...]
    """Segments whose joint was never tracked; they keep the alignment they had."""


def facing(up: Sequence[float], forward: Sequence[float]) -> Quaternion:
    """U^T [4]: from sensor axes to the person's left, up, forward.

    Args:
        up: the person's up [3] in sensor axes, any length.
        forward: the way the person faces [3] in sensor axes; made square to `up`.

    Raises:
        InputError: a vector without length, or both along one line.
    """
    u, f = np.asarray(up, np.float64), np.asarray(forward, np.float64)
    left = np.cross(u, f)
    if not np.isfinite(left).all() or np.sqrt(left @ left) < 1e-6:
        raise InputError(f"up {list(up)} and forward {list(forward)} span no plane; expected two different directions")
    u, left = u / np.sqrt(u @ u), left / np.sqrt(left @ left)
    return from_matrix(np.stack([left, u, np.cross(left, u)]))


def calibrate(
    skeleton: Skeleton,
    rotations: npt.NDArray[np.float64],
    observed: npt.NDArray[np.bool_],
    *,
    axes: Axes,
    pose: HeldPose,
    person: Quaternion,
) -> Calibration:
    """The skeleton with the alignment that makes a held pose what it is.

    Args:
        skeleton: the source: its joints, parents and drives; its alignment is replaced.
        rotations: [frame, joint, 4] xyzw of the held pose.
        observed: [frame, joint].
        axes: of the rotations.
        pose: which pose was held.
        person: U^T [4], from `facing`.

    Raises:
        InputError: no frame, a source without a pelvis joint, or a pose that was not held still.
    """
    if not len(rotations):
        raise InputError("there is no frame to calibrate from; expected a pose held for a second")
    if skeleton.needs_local:
        raise InputError(f"skeleton {skeleton.name!r} has no pelvis joint; expected a sensor's own rotations")
    turned = rotations if axes == "global" else _compose(skeleton.parents, rotations)
    bind, unseen, spread = skeleton.bind.copy(), [], 0.0
    for index, (segment, joint) in enumerate(zip(SEGMENTS, skeleton.drives, strict=True)):
        if joint is None:
            continue
        held = normalise(turned[observed[:, joint], joint])  # [frame, 4]
        if not len(held):
            unseen.append(segment)
            continue
        centre = mean(held)
        strayed = float(angle_between(held, np.broadcast_to(centre, held.shape)).max())
        if strayed > STILL_RAD:
            raise InputError(f"the pose was not held still: {segment} strayed by {np.degrees(strayed):.0f} degrees")
        spread = max(spread, strayed)
        aim = conjugate(POSES[pose].get(segment, IDENTITY))
        bind[index] = multiply(multiply(aim, person), centre)
    return Calibration(replace(skeleton, bind=bind), len(rotations), float(np.degrees(spread)), tuple(unseen))


def _compose(parents: Sequence[int], local: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Orientations [frame, joint, 4] from local rotations; parents may stand anywhere in the order."""
    whole = np.empty_like(local)
    done: set[int] = set()
    waiting = list(range(len(parents)))
    while waiting:
        joint = waiting.pop(0)
        parent = parents[joint]
        if parent != ROOT and parent not in done:
            waiting.append(joint)
            continue
        whole[:, joint] = local[:, joint] if parent == ROOT else multiply(whole[:, parent], local[:, joint])
        done.add(joint)
    return whole
