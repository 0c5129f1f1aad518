"""Poses as callers have them (arrays, nested lists, gaps) to the joints of a frame.

[joint, 4] are quaternions, [joint, 3] the positions that landmark sensors give. A joint that is None or holds a NaN
counts as untracked, and so does a quaternion that is all zero (the service sees to that). An infinite number is a bug
of the caller and refused, and so is any other shape.
"""

from collections.abc import Sequence
from typing import TypedDict

import numpy as np
import numpy.typing as npt

from fervor.errors import FrameError
from fervor.protocol.messages import Quaternion, Vector

Pose = npt.ArrayLike | Sequence[Sequence[float] | None]
"""[joint, 4] in the order of numbers that the session agreed on (the skeleton's own unless told otherwise), or [joint,
3] where the skeleton is a landmark sensor."""


class Joints(TypedDict, total=False):
    """The field of a frame that a pose goes into."""

    q: tuple[Quaternion | None, ...]
    p: tuple[Vector | None, ...]


def to_joints(pose: Pose, joints: Sequence[str], *, width: int = 4) -> Joints:
    """What to send for a pose of `joints`; None where untracked.

    Args:
        pose: [joint, 4] or [joint, 3].
        joints: names, in order.
        width: numbers a joint has, for a pose in which every joint is None.

    Raises:
        FrameError: another shape, or an infinite number.
    """
    array = _array(pose, width)
    if array.ndim != 2 or array.shape[0] != len(joints) or array.shape[1] not in (3, 4):
        expected = f"expected [{len(joints)}, 4] (quaternions) or [{len(joints)}, 3] (positions)"
        raise FrameError(f"the pose has the shape {list(array.shape)}; {expected}")
    untracked = np.any(np.isnan(array), axis=-1)  # [joint]
    wrong = np.isinf(array).any(axis=-1) & ~untracked  # [joint]
    if wrong.any():
        index = int(wrong.argmax())
        raise FrameError(f"joint {index} ({joints[index]}) holds an infinite number; untracked joints are None or NaN")
    rows: list[list[float]] = array.tolist()
    gaps: list[bool] = untracked.tolist()
    if array.shape[1] == 4:
        return {"q": tuple(None if gap else (x, y, z, w) for (x, y, z, w), gap in zip(rows, gaps, strict=True))}
    return {"p": tuple(None if gap else (x, y, z) for (x, y, z), gap in zip(rows, gaps, strict=True))}


def _array(pose: Pose, width: int) -> npt.NDArray[np.float64]:
    """The pose as float64; joints that are None become NaN."""
    try:
        array = np.asarray(pose, np.float64)
    except (TypeError, ValueError):
        return _filled(pose, width)
    return _filled(pose, width) if array.ndim == 1 and np.isnan(array).all() else array


def _filled(pose: Pose, width: int) -> npt.NDArray[np.float64]:
    try:
        rows: list[Sequence[float] | None] = list(pose)  # type: ignore[arg-type]
        width = next((len(row) for row in rows if row is not None), width)
        return np.array([[np.nan] * width if row is None else row for row in rows], np.float64)
    except (TypeError, ValueError):
        raise FrameError("the pose is not an array of numbers; expected [joint, 4] or [joint, 3]") from None
