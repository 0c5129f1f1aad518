"""The joints of a frame as arrays, checked: the one gate through which poses enter.

A poisoned frame (a value that is not finite, a wrong joint count, a quaternion far from unit length) is refused whole;
an untracked joint (null, all zero, mask false) is not an error but unobserved.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fervor.errors import FrameError
from fervor.protocol.messages import Frame, Raw
from fervor.skeletons.skeleton import QuaternionOrder

FARTHEST = 1e9
"""A coordinate beyond this is no place in a room, whatever its unit."""

UNTRACKED_BELOW = 0.5
"""A quaternion shorter than this is a sensor's way to say that it does not see the joint (Kinect leaves send zeros)."""

NOT_UNIT_ABOVE = 2.0
"""A quaternion longer than this is no rotation at all; a sender's bug, not noise."""

SHORTEST_SQUARED, LONGEST_SQUARED = UNTRACKED_BELOW**2, NOT_UNIT_ABOVE**2
"""The same of squared lengths, which spare a root."""

_OF_WXYZ = np.array((1, 2, 3, 0))
"""Where x, y, z, w stand in w, x, y, z."""


def squared_lengths(rotations: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Of quaternions [..., 4]; to be called where numpy is told to overlook an overflow."""
    squares: npt.NDArray[np.float64] = np.vecdot(rotations, rotations)
    return squares


def to_xyzw(rotations: npt.NDArray[np.float64], order: QuaternionOrder) -> npt.NDArray[np.float64]:
    """Quaternions [..., 4] that came in some order."""
    return rotations if order == "xyzw" else rotations.take(_OF_WXYZ, axis=-1)


@np.errstate(over="ignore", invalid="ignore")  # poison is told by a sentence, not by a warning
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
    if frame.p is not None:
        raise _refuse(frame, "has positions in p; expected quaternions in q alone, as this skeleton has rotations")
    rotations = _joints_of(frame, frame.q, "q", joints, 4)
    squares = squared_lengths(rotations)
    right = squares <= LONGEST_SQUARED
    if not right.all():
        raise _refuse(frame, _bad_quaternion(rotations, joints, int(right.argmin())))
    observed = squares >= SHORTEST_SQUARED
    if frame.mask is not None:
        observed &= np.array(frame.mask)
    return to_xyzw(rotations, order), observed


@np.errstate(invalid="ignore")
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
    if frame.q is not None:
        raise _refuse(frame, "has quaternions in q; expected positions in p alone, as this is a landmark sensor")
    positions = _joints_of(frame, frame.p, "p", joints, 3)
    untracked: npt.NDArray[np.bool_]
    if isinstance(frame.p, Raw):
        untracked = np.any(np.isnan(positions), axis=-1)
    else:
        untracked = np.array([at is None for at in frame.p or ()], np.bool_)
    positions = np.where(untracked[:, None], 0.0, positions)
    wrong = ~(np.abs(positions).max(axis=-1) <= FARTHEST)
    if wrong.any():
        index = int(wrong.argmax())
        where = f"joint {index} ({joints[index]})"
        raise _refuse(frame, f"has {positions[index].tolist()} at {where}; expected three finite numbers")
    return positions, ~untracked if frame.mask is None else ~untracked & np.array(frame.mask)


def _joints_of(
    frame: Frame, sent: Sequence[Sequence[float] | None] | Raw | None, field: str, joints: Sequence[str], width: int
) -> npt.NDArray[np.float64]:
    """What a frame sends of its joints [joint, width], as many as agreed; zeros where null."""
    if sent is None:
        raise _refuse(frame, f"has no {field}; expected {len(joints)} joints in it")
    if isinstance(sent, Raw):
        array = _from_raw(frame, sent.root, field, joints, width)
    elif len(sent) != len(joints):
        raise _refuse(frame, f"has {len(sent)} joints in {field}; expected {len(joints)}")
    else:
        array = np.array([joint or (0.0,) * width for joint in sent], np.float64)
    if frame.mask is not None and len(frame.mask) != len(joints):
        raise _refuse(frame, f"has {len(frame.mask)} entries in mask; expected {len(joints)}")
    return array


def _from_raw(frame: Frame, raw: bytes, field: str, joints: Sequence[str], width: int) -> npt.NDArray[np.float64]:
    expected = 4 * width * len(joints)
    if len(raw) != expected:
        raise _refuse(
            frame, f"has {len(raw)} bytes in {field}; expected {expected}: {len(joints)} joints of {width} float32"
        )
    return np.frombuffer(raw, "<f4").reshape(len(joints), width).astype(np.float64)


def _bad_quaternion(rotations: npt.NDArray[np.float64], joints: Sequence[str], index: int) -> str:
    values = rotations[index].tolist()
    where = f"joint {index} ({joints[index]})"
    if not np.isfinite(values).all():
        return f"has {values} at {where}; expected four finite numbers"
    return f"has a quaternion far from unit length at {where}: {values}"


def _refuse(frame: Frame, what: str) -> FrameError:
    return FrameError(f"frame {frame.seq} of body {frame.body!r} {what}", body=frame.body, seq=frame.seq)
