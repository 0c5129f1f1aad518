"""Recordings as plain tables of numbers: what CSV, JSONL and NPZ files have in common.

A table has times in seconds (or a rate), and for every frame and joint either a quaternion or a position. It names its
source: a skeleton of the catalogue for rotations, a landmark sensor for positions. Where it names none, the joint names
tell. A joint may be missing from the table, or from a frame (NaN, null, mask): then it is unobserved.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError, RecordingError
from fervor.recordings.recording import Recording
from fervor.rotations import length, to_xyzw
from fervor.skeletons.adapter import check_axes
from fervor.skeletons.canonical import C13
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.landmarks import LANDMARKS, Landmarks, landmarks
from fervor.skeletons.positions import local_over_time
from fervor.skeletons.skeleton import Axes, QuaternionOrder, Skeleton

LONGEST = 2.0
"""A quaternion longer than this is no rotation at all, but an error of whoever wrote the file."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """What a file says, before it is checked and understood."""

    label: str  # for messages: the file's name
    name: str
    values: npt.NDArray[np.float64]  # [frame, joint, 4] quaternions or [frame, joint, 3] positions; NaN: unobserved
    times: npt.NDArray[np.float64] | None = None  # [frame] seconds
    rate_hz: float | None = None  # where there are no times
    observed: npt.NDArray[np.bool_] | None = None  # [frame, joint]
    joints: tuple[str, ...] | None = None
    skeleton: str | None = None
    axes: str | None = None
    quaternion: str | None = None

    def fail(self, what: str) -> RecordingError:
        """The error that says `what` of this file."""
        return RecordingError(f"{self.label}: {what}")


def to_recording(table: Table, source: str | Skeleton | None = None) -> Recording:
    """The recording that a table holds.

    Args:
        table: what the file says.
        source: a skeleton or the name of a skeleton or landmark sensor; wins over what the table says.

    Raises:
        RecordingError: numbers or names that don't fit.
    """
    if table.values.ndim != 3 or table.values.shape[2] not in (3, 4) or 0 in table.values.shape:
        raise table.fail(f"numbers have the shape {list(table.values.shape)}; expected [frame, joint, 4 or 3]")
    times = _times(table)
    if np.isinf(table.values).any():
        raise table.fail(f"frame {int(np.argwhere(np.isinf(table.values))[0, 0])} holds an infinite number")
    given = np.asarray(~np.isnan(table.values).any(axis=-1), np.bool_)
    if table.observed is not None:
        if table.observed.shape != given.shape:
            raise table.fail(f"the mask has the shape {list(table.observed.shape)}; expected {list(given.shape)}")
        given = given & table.observed
    values = np.where(given[..., None], table.values, 0.0)
    try:
        if table.values.shape[2] == 3:
            return _from_positions(table, times, values, given, source)
        return _from_rotations(table, times, values, given, source)
    except RecordingError:
        raise
    except InputError as error:
        raise table.fail(error.message) from error


def _times(table: Table) -> npt.NDArray[np.float64]:
    """Times [frame] in seconds from the first frame."""
    frames = len(table.values)
    if table.times is None:
        if table.rate_hz is None or not (np.isfinite(table.rate_hz) and table.rate_hz > 0.0):
            raise table.fail("neither times nor a rate_hz over 0; expected one of them")
        return np.arange(frames, dtype=np.float64) / table.rate_hz
    if table.times.shape != (frames,):
        raise table.fail(f"{table.times.size} times for {frames} frames; expected one each")
    if not np.isfinite(table.times).all():
        raise table.fail(f"the time of frame {int(np.argmin(np.isfinite(table.times)))} is not a finite number")
    backwards = np.diff(table.times) <= 0.0
    if backwards.any():
        raise table.fail(f"the time of frame {int(backwards.argmax()) + 1} does not rise; expected rising seconds")
    shifted: npt.NDArray[np.float64] = table.times - table.times[0]
    return shifted


def _from_rotations(
    table: Table,
    times: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
    given: npt.NDArray[np.bool_],
    source: str | Skeleton | None,
) -> Recording:
    known = source if isinstance(source, Skeleton) else _skeleton(table, source)
    order, axes = _order(table, known), _axes(table, known)
    check_axes(known, axes)
    with np.errstate(over="ignore"):
        far = ~(length(values) <= LONGEST)
    if far.any():
        frame, joint = (int(index) for index in np.argwhere(far)[0])
        raise table.fail(f"frame {frame} has a quaternion far from unit length at joint {joint}")
    places = _places(table, known.joints, values.shape[1], f"skeleton {known.name!r}")
    rotations = np.zeros((len(values), len(known.joints), 4))
    observed = np.zeros(rotations.shape[:-1], np.bool_)
    rotations[:, places], observed[:, places] = to_xyzw(values, order), given
    return Recording(table.name, known, times, rotations, observed, axes)


def _from_positions(
    table: Table,
    times: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
    given: npt.NDArray[np.bool_],
    source: str | Skeleton | None,
) -> Recording:
    if isinstance(source, Skeleton):
        raise table.fail(f"it holds positions; expected a landmark sensor, not the skeleton {source.name!r}")
    known = _landmarks(table, source)
    places = _places(table, known.joints, values.shape[1], f"landmark sensor {known.name!r}")
    positions = np.zeros((len(values), len(known.joints), 3))
    observed = np.zeros(positions.shape[:-1], np.bool_)
    positions[:, places], observed[:, places] = values, given
    local, seen = local_over_time(known, positions, observed)
    return Recording(table.name, C13, times, local, seen, "local")


def _skeleton(table: Table, name: str | None) -> Skeleton:
    """The skeleton by its name, or by the names of its joints."""
    wanted = name or table.skeleton
    if wanted is not None:
        return skeleton(wanted)
    fitting = [known for known in SKELETONS.values() if table.joints and set(table.joints) <= set(known.joints)]
    if not fitting:
        raise table.fail(f"it names no skeleton, and its joints fit none; expected one of {', '.join(SKELETONS)}")
    return min(fitting, key=lambda known: len(known.joints))


def _landmarks(table: Table, name: str | None) -> Landmarks:
    """The landmark sensor by its name, or by the names of its points."""
    wanted = name or table.skeleton
    if wanted is not None:
        return landmarks(wanted)
    fitting = [known for known in LANDMARKS.values() if table.joints and set(table.joints) <= set(known.joints)]
    if not fitting:
        raise table.fail(
            f"it names no landmark sensor, and its points fit none; expected one of {', '.join(LANDMARKS)}"
        )
    return min(fitting, key=lambda known: len(known.joints))


def _order(table: Table, known: Skeleton) -> QuaternionOrder:
    match table.quaternion:
        case None:
            return known.quaternion
        case "xyzw" | "wxyz" as order:
            return order
        case other:
            raise table.fail(f"quaternion is {other!r}; expected 'xyzw' or 'wxyz'")


def _axes(table: Table, known: Skeleton) -> Axes:
    match table.axes:
        case None:
            return known.axes
        case "local" | "global" as axes:
            return axes
        case other:
            raise table.fail(f"axes is {other!r}; expected 'local' or 'global'")


def _places(table: Table, joints: tuple[str, ...], count: int, what: str) -> list[int]:
    """Where the table's joints belong."""
    if table.joints is None:
        if count != len(joints):
            raise table.fail(f"{what} has {len(joints)} joints; got {count}, and no names for them")
        return list(range(count))
    if len(table.joints) != count or len(set(table.joints)) != count:
        raise table.fail(f"{len(set(table.joints))} different joint names for {count} joints; expected one each")
    unknown = [joint for joint in table.joints if joint not in joints]
    if unknown:
        raise table.fail(f"{what} has no joint {unknown[0]!r}; expected some of {', '.join(joints)}")
    return [joints.index(joint) for joint in table.joints]
