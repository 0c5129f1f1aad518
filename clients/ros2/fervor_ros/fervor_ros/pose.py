"""A pose as the core has it, wherever it came from."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Stamp = int
"""Nanoseconds of the ROS clock that headers bear."""

STEP_BACK_NS = 1_000_000_000
"""What is older than the newest by no more than this is late; by more, the clock was set back: a bag begins anew."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """All joint rotations of one body at one instant."""

    body: str
    stamp: Stamp
    rotations: npt.NDArray[np.float64]  # [joint, 4] xyzw, in the skeleton's order; NaN where untracked


def in_order(
    joints: Sequence[str], names: Iterable[str], rotations: Iterable[Sequence[float]], *, body: str = ""
) -> npt.NDArray[np.float64]:
    """Named rotations in the order of a skeleton's joints.

    Args:
        joints: of the skeleton.
        names: as they came, with or without `_<body>`; others are passed over.
        rotations: a quaternion a name.
        body: the id.

    Returns:
        [joint, 4]; NaN where no rotation came.
    """
    index = {joint: position for position, joint in enumerate(joints)}
    ordered = np.full((len(joints), 4), np.nan)
    suffix = f"_{body}"
    for name, rotation in zip(names, rotations, strict=False):
        position = index.get(name, index.get(name.removesuffix(suffix)))
        if position is not None and np.isfinite(rotation).all():
            ordered[position] = rotation
    return ordered
