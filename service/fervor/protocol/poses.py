"""The joints of a frame as arrays, checked: the one gate through which poses enter.

A poisoned frame (a value that is not finite, a wrong joint count, a quaternion far from unit length) is refused whole;
an untracked joint (null, all zero, mask false) is not an error but unobserved.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fervor.errors import FrameError
from fervor.protocol.messages import Frame
from fervor.skeletons.skeleton import QuaternionOrder

UNTRACKED_BELOW = 0.5
"""A quaternion shorter than this is a sensor's way to say that it does not see the joint (Kinect leaves send zeros)."""

NOT_UNIT_ABOVE = 2.0
"""A quaternion longer than this is no rotation at all; a sender's bug, not noise."""


def frame_pose(
    frame: Frame, joints: Sequence[str], order: QuaternionOrder
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """The rotations of a frame.

    Args:
        frame: as it came.
        joints: names of the joints the session sends, in order.
        order: of the quaternion's numbers on the wire.

    Returns:
        rotations float64 [joint, 4] xyzw, as sent but for the order; observed bool [joint].

    Raises:
        FrameError: wrong number of joints or mask entries, a value that is not finite, a quaternion far from unit.
    """
    if len(frame.q) != len(joints):
        raise _refuse(frame, f"has {len(frame.q)} joints in q; expected {len(joints)}")
    if frame.mask is not None and len(frame.mask) != len(joints):
        raise _refuse(frame, f"has {len(frame.mask)} entries in mask; expected {len(joints)}")
    rotations = np.array([q or (0.0, 0.0, 0.0, 0.0) for q in frame.q], np.float64)  # [joint, 4]
    with np.errstate(over="ignore"):
        lengths = np.sqrt(np.sum(rotations * rotations, axis=-1))  # [joint]
    wrong = ~(lengths <= NOT_UNIT_ABOVE)
    if wrong.any():
        raise _refuse(frame, _bad_joint(frame, joints, int(wrong.argmax())))
    observed = lengths >= UNTRACKED_BELOW
    if frame.mask is not None:
        observed &= np.array(frame.mask)
    return (rotations if order == "xyzw" else np.roll(rotations, -1, axis=-1)), observed


def _bad_joint(frame: Frame, joints: Sequence[str], index: int) -> str:
    values = frame.q[index]
    where = f"joint {index} ({joints[index]})"
    if not np.isfinite(values).all():  # type: ignore[arg-type]  # a null joint has length 0 and is never wrong
        return f"has {list(values or ())} at {where}; expected four finite numbers"
    return f"has a quaternion far from unit length at {where}: {list(values or ())}"


def _refuse(frame: Frame, what: str) -> FrameError:
    return FrameError(f"frame {frame.seq} of body {frame.body!r} {what}", body=frame.body, seq=frame.seq)
