"""Recordings as NPZ: NumPy arrays by name.

`rotations` [frame, joint, 4] or `positions` [frame, joint, 3]; `times` [frame] in seconds or `rate_hz`; and where
needed `observed` [frame, joint], `joints` (names), `skeleton`, `axes`, `quaternion` (text). Other arrays are ignored.
Pickled objects are refused.
"""

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.source import Content
from fervor.recordings.tabular import Table, to_recording
from fervor.skeletons.skeleton import Skeleton

MOST_BYTES = 1 << 30
"""Most that the arrays of one file may unpack to: three hours of 25 joints at 120 Hz."""

_NAMES = ("rotations", "positions", "times", "rate_hz", "observed", "joints", "skeleton", "axes", "quaternion")


def parse_npz(content: Content, skeleton: str | Skeleton | None = None) -> Recording:
    """The recording in an NPZ file.

    Raises:
        RecordingError: the file can't be used; the sentence says why.
    """
    arrays = _load(content)
    values = arrays.get("rotations", arrays.get("positions"))
    if values is None or ("rotations" in arrays) == ("positions" in arrays):
        raise RecordingError(f"{content.label}: expected either 'rotations' or 'positions' among its arrays")
    rate = arrays.get("rate_hz")
    table = Table(
        label=content.label,
        name=content.name,
        values=_numbers(content.label, "rotations" if "rotations" in arrays else "positions", values),
        times=_numbers(content.label, "times", arrays["times"]) if "times" in arrays else None,
        rate_hz=None if rate is None or rate.size != 1 else float(_numbers(content.label, "rate_hz", rate).item()),
        observed=arrays["observed"].astype(np.bool_) if "observed" in arrays else None,
        joints=tuple(str(name) for name in arrays["joints"].ravel()) if "joints" in arrays else None,
        skeleton=_text(arrays, "skeleton"),
        axes=_text(arrays, "axes"),
        quaternion=_text(arrays, "quaternion"),
    )
    width = 4 if "rotations" in arrays else 3
    if table.values.shape[-1:] != (width,):
        raise table.fail(f"numbers have the shape {list(table.values.shape)}; expected [frame, joint, {width}]")
    return to_recording(table, skeleton)


def _load(content: Content) -> dict[str, npt.NDArray[Any]]:
    """The arrays of the file that have a meaning here."""
    try:
        with zipfile.ZipFile(io.BytesIO(content.data)) as packed:
            if sum(item.file_size for item in packed.infolist()) <= MOST_BYTES:
                known = (item for item in packed.infolist() if item.filename.removesuffix(".npy") in _NAMES)
                return {item.filename.removesuffix(".npy"): _array(packed, item) for item in known}
    except Exception as error:  # zipfile, zlib and numpy each raise their own, on any damage
        raise RecordingError(f"{content.label}: not an NPZ file that can be read ({error})") from error
    raise RecordingError(f"{content.label}: the arrays unpack to more than {MOST_BYTES >> 20} MiB")


def _array(packed: zipfile.ZipFile, item: zipfile.ZipInfo) -> npt.NDArray[Any]:
    with packed.open(item) as content:
        array: npt.NDArray[Any] = np.lib.format.read_array(content, allow_pickle=False)
    return array


def _numbers(label: str, name: str, array: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    if array.dtype.kind not in "fiu":
        raise RecordingError(f"{label}: the array {name!r} holds {array.dtype}; expected numbers")
    return array.astype(np.float64)


def _text(arrays: Mapping[str, npt.NDArray[Any]], name: str) -> str | None:
    return str(arrays[name].item()) if name in arrays and arrays[name].size == 1 else None


def npz_of(recording: Recording) -> bytes:
    """A recording's canonical rotations as NPZ."""
    times, local, observed = rig_poses(recording)
    out = io.BytesIO()
    np.savez_compressed(
        out, times=times, rotations=local, observed=observed, skeleton="c13", axes="local", quaternion="xyzw"
    )
    return out.getvalue()
