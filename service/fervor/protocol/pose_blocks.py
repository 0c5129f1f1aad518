"""The joints of many frames as arrays, at once: what `fervor.protocol.poses` gives one by one.

A frame's rows are what the plain gate gives, to the bit, or the frame is said to be doubtful. Of those that gate
decides, so that one place alone says what is wrong.
"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import chain
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import Raw
from fervor.protocol.poses import FARTHEST, LONGEST_SQUARED, SHORTEST_SQUARED, squared_lengths, to_xyzw
from fervor.protocol.skeleton_spec import MOST_JOINTS
from fervor.skeletons.skeleton import QuaternionOrder

Sent = Sequence[Sequence[float] | None] | bytes | Raw | None
"""What a frame has in `q` or `p`; bytes are little-endian float32."""

Masks = Sequence[Sequence[bool] | None]
"""What each frame has in `mask`."""


class PoseBlock(msgspec.Struct, frozen=True, eq=False, gc=False):
    """The joints of frames."""

    joints: npt.NDArray[np.float64]
    """[frame, joint, 4] rotations xyzw, or [frame, joint, 3] positions; perhaps read-only."""
    observed: npt.NDArray[np.bool_]  # [frame, joint]
    doubtful: set[int]
    """Frames that are not surely right: their rows mean nothing."""


@np.errstate(over="ignore", invalid="ignore")  # what is beyond all numbers is doubtful, which is enough
def rotation_block(sent: Sequence[Sent], masks: Masks, joints: int, order: QuaternionOrder) -> PoseBlock:
    """The rotations of frames, as `frame_pose` gives them.

    Args:
        sent: what each frame has in `q`.
        masks: of each frame.
        joints: that a frame must have.
        order: of the quaternion's numbers.
    """
    read = _read(sent, masks, joints, 4)
    squares = squared_lengths(read.numbers)
    _doubt(squares <= LONGEST_SQUARED, read.doubtful)
    observed = squares >= SHORTEST_SQUARED
    if read.seen is not None:
        observed &= read.seen
    return PoseBlock(to_xyzw(read.numbers, order), observed, read.doubtful)


@np.errstate(invalid="ignore")
def position_block(sent: Sequence[Sent], masks: Masks, joints: int) -> PoseBlock:
    """The positions of frames of a landmark sensor, as `frame_points` gives them.

    Args:
        sent: what each frame has in `p`.
        masks: of each frame.
        joints: points that a frame must have.
    """
    read = _read(sent, masks, joints, 3)
    _doubt(np.abs(read.numbers).max(axis=-1) <= FARTHEST, read.doubtful)
    seen = np.ones((len(sent), joints), np.bool_) if read.seen is None else read.seen
    return PoseBlock(read.numbers, seen, read.doubtful)


def _doubt(right: npt.NDArray[np.bool_], doubtful: set[int]) -> None:
    """Note the frames with a joint [frame, joint] that is not right."""
    if np.count_nonzero(right) < right.size:
        doubtful.update(np.flatnonzero(~right.all(axis=-1)).tolist())


class _Joints(msgspec.Struct, frozen=True, eq=False, gc=False):
    """What frames say of their joints."""

    numbers: npt.NDArray[np.float64]  # [frame, joint, width], zero where null
    seen: npt.NDArray[np.bool_] | None
    """[frame, joint] neither null nor masked, so far as the numbers don't tell; None where all are."""
    doubtful: set[int]


def _read(sent: Sequence[Sent], masks: Masks, joints: int, width: int) -> _Joints:
    read = _numbers(sent, joints, width)
    if masks.count(None) == len(masks):
        return read
    every = b"\1" * joints
    flags = [every if mask is None else bytes(mask) for mask in masks]
    read.doubtful.update(row for row, mask in enumerate(flags) if len(mask) != joints)
    unmasked = _flags([mask if len(mask) == joints else every for mask in flags])
    return _Joints(read.numbers, unmasked if read.seen is None else read.seen & unmasked, read.doubtful)


def _numbers(sent: Sequence[Sent], joints: int, width: int) -> _Joints:
    raw = [each for each in sent if isinstance(each, bytes)]
    if len(raw) == len(sent):
        return _from_raw(raw, joints, width)
    arrays = [each for each in sent if not isinstance(each, bytes)]
    if not raw:
        return _from_arrays(arrays, joints, width)
    numbers, seen = np.empty((len(sent), joints, width)), np.ones((len(sent), joints), np.bool_)
    is_raw, doubtful = np.array([isinstance(each, bytes) for each in sent]), set[int]()
    for rows, part in (
        (np.flatnonzero(is_raw), _from_raw(raw, joints, width)),
        (np.flatnonzero(~is_raw), _from_arrays(arrays, joints, width)),
    ):
        numbers[rows] = part.numbers
        if part.seen is not None:
            seen[rows] = part.seen
        doubtful.update(rows[list(part.doubtful)].tolist())
    return _Joints(numbers, seen, doubtful)


def _from_raw(raw: Sequence[bytes], joints: int, width: int) -> _Joints:
    size, doubtful = 4 * joints * width, set[int]()
    if set(map(len, raw)) != {size}:
        doubtful = {row for row, each in enumerate(raw) if len(each) != size}
        raw = [bytes(size) if len(each) != size else each for each in raw]
    numbers = np.frombuffer(b"".join(raw), "<f4").astype(np.float64).reshape(-1, joints, width)
    if width == 4:  # a quaternion of zeros is untracked as it is
        return _Joints(numbers, None, doubtful)
    seen = np.logical_not(np.isnan(numbers).any(axis=-1))
    numbers[~seen] = 0.0
    return _Joints(numbers, seen, doubtful)


def _from_arrays(sent: Sequence[Any], joints: int, width: int) -> _Joints:
    pack = _packer(joints * width)  # nested tuples become an array at a third of what numpy takes
    every, hole = b"\1" * joints, (0.0,) * width
    packed, flags = [], []
    for each in sent:
        try:
            if all(each):
                packed.append(pack(*_flat(each)))
                flags.append(every)
            else:  # joints that are null; a quaternion of zeros is untracked as it is
                packed.append(pack(*_flat([joint or hole for joint in each])))
                flags.append(every if width == 4 else bytes([joint is not None for joint in each]))
        except (TypeError, struct.error):  # nothing there, or too many or few
            packed.append(bytes(8 * joints * width))
            flags.append(b"")
    numbers = np.frombuffer(b"".join(packed)).reshape(-1, joints, width)
    if flags.count(every) == len(flags):
        return _Joints(numbers, None, set())
    doubtful = {row for row, tracked in enumerate(flags) if not tracked}
    return _Joints(numbers, _flags([tracked or every for tracked in flags]), doubtful)


_flat: Callable[[Sequence[Sequence[float]]], chain[float]] = chain.from_iterable


@lru_cache(maxsize=2 * MOST_JOINTS)
def _packer(numbers: int) -> Callable[..., bytes]:
    """Makes the bytes of an array of so many numbers."""
    return struct.Struct(f"{numbers}d").pack


def _flags(rows: Sequence[bytes]) -> npt.NDArray[np.bool_]:
    """What is true of each joint: [row, joint]."""
    return np.frombuffer(b"".join(rows), np.bool_).reshape(len(rows), -1)
