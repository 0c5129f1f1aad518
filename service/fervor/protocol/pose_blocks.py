"""The joints of many frames as arrays, at once: `fervor.protocol.poses` for whole sequences.

It takes a sequence only if all of it is surely right, and gives what the plain gate gives frame by frame. What it does
not take, that gate decides, so that one place alone says what is wrong.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import Raw
from fervor.protocol.poses import NOT_UNIT_ABOVE, UNTRACKED_BELOW
from fervor.skeletons.skeleton import QuaternionOrder

Sent = Sequence[Sequence[float] | None] | bytes | Raw | None


def pose_block(
    sent: Sequence[Sent], masks: Sequence[Sequence[bool] | None], joints: int, order: QuaternionOrder
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]] | None:
    """The rotations of frames, and which are observed.

    Args:
        sent: what each frame has in `q`; bytes are little-endian float32.
        masks: what each frame has in `mask`.
        joints: that a frame must have.
        order: of the quaternion's numbers.

    Returns:
        rotations float64 [frame, joint, 4] xyzw and observed [frame, joint], as `frame_pose`; None where a frame is
        wrong, has untracked joints as null, or is unlike the others.
    """
    rotations = _rotations(sent, joints)
    if rotations is None:
        return None
    with np.errstate(over="ignore"):
        lengths = np.sqrt(np.add.reduce(rotations * rotations, axis=-1))
    if not (lengths <= NOT_UNIT_ABOVE).all():
        return None
    observed = lengths >= UNTRACKED_BELOW
    if masks.count(None) < len(masks):
        if not all(mask is not None and len(mask) == joints for mask in masks):
            return None
        observed &= np.array(masks, np.bool_)
    return (rotations if order == "xyzw" else np.roll(rotations, -1, axis=-1)), observed


def _rotations(sent: Sequence[Sent], joints: int) -> npt.NDArray[np.float64] | None:
    """As they were sent, [frame, joint, 4]."""
    kinds = set(map(type, sent))
    if bytes in kinds:
        raw = [each for each in sent if isinstance(each, bytes)]
        if len(kinds) > 1 or set(map(len, raw)) != {16 * joints}:
            return None
        return np.frombuffer(b"".join(raw), "<f4").reshape(len(sent), joints, 4).astype(np.float64)
    try:
        rotations = np.array(sent, np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return rotations if rotations.shape == (len(sent), joints, 4) else None
