"""The joints of a frame as arrays, checked: the one gate through which poses enter.

A poisoned frame (a value that is not finite, a wrong joint count, a quaternion far from unit length) is refused whole;
an untracked joint (null, all zero, mask false) is not an error but unobserved.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fervor.errors import FrameError
from fervor.protocol.messages import Frame, Quaternion
from fervor.skeletons.skeleton import QuaternionOrder

T = TypeVar("T")

FARTHEST = 1e9
"""A coordinate beyond this is no place in a room, whatever its unit."""

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
    sent = _joints_of(frame, frame.q, "q", joints)
    if frame.p is not None:
        raise _refuse(frame, "has positions in p; expected quaternions in q alone, as this skeleton has rotations")
    rotations = np.array([q or (0.0, 0.0, 0.0, 0.0) for q in sent], np.float64)  # [joint, 4]
    with np.errstate(over="ignore"):
        lengths = np.sqrt(np.sum(rotations * rotations, axis=-1))  # [joint]
    wrong = ~(lengths <= NOT_UNIT_ABOVE)
    if wrong.any():
        raise _refuse(frame, _bad_quaternion(sent, joints, int(wrong.argmax())))
    observed = lengths >= UNTRACKED_BELOW
    if frame.mask is not None:
        observed &= np.array(frame.mask)
    return (rotations if order == "xyzw" else np.roll(rotations, -1, axis=-1)), observed


def frame_points(frame: Frame, joints: Sequence[str]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """The positions of a frame of a landmark sensor.

    Args:
        frame: as it came.
        joints: names of the points the session sends, in order.

    Returns:
        positions float64 [joint, 3], zero where untracked; observed bool [joint].

    Raises:
        FrameError: wrong number of points or mask entries, or a value that is not finite or beyond any room.
    """
    sent = _joints_of(frame, frame.p, "p", joints)
    if frame.q is not None:
        raise _refuse(frame, "has quaternions in q; expected positions in p alone, as this is a landmark sensor")
    positions = np.array([p or (0.0, 0.0, 0.0) for p in sent], np.float64)  # [joint, 3]
    wrong = ~(np.abs(positions).max(axis=-1) <= FARTHEST)
    if wrong.any():
        index = int(wrong.argmax())
        where = f"joint {index} ({joints[index]})"
        raise _refuse(frame, f"has {list(sent[index] or ())} at {where}; expected three finite numbers")
    observed = np.array([p is not None for p in sent], np.bool_)
    return positions, observed if frame.mask is None else observed & np.array(frame.mask)


def _joints_of(frame: Frame, sent: tuple[T, ...] | None, field: str, joints: Sequence[str]) -> tuple[T, ...]:
    """What a frame sends of its joints, as many as agreed."""
    if sent is None:
        raise _refuse(frame, f"has no {field}; expected {len(joints)} joints in it")
    if len(sent) != len(joints):
        raise _refuse(frame, f"has {len(sent)} joints in {field}; expected {len(joints)}")
    if frame.mask is not None and len(frame.mask) != len(joints):
        raise _refuse(frame, f"has {len(frame.mask)} entries in mask; expected {len(joints)}")
    return sent


def _bad_quaternion(sent: Sequence[Quaternion | None], joints: Sequence[str], index: int) -> str:
    values = list(sent[index] or ())
    where = f"joint {index} ({joints[index]})"
    if not np.isfinite(values).all():
        return f"has {values} at {where}; expected four finite numbers"
    return f"has a quaternion far from unit length at {where}: {values}"


def _refuse(frame: Frame, what: str) -> FrameError:
    return FrameError(f"frame {frame.seq} of body {frame.body!r} {what}", body=frame.body, seq=frame.seq)
