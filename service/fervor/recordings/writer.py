"""Writes recordings as canonical ones: whatever the source was, the file holds the rig's local rotations.

CSV, JSONL and NPZ keep every bit and every gap. BVH knows neither masks nor uneven times: unobserved joints hold their
last pose there, and frames are put on an even grid. It is the rig in an N-pose, on the standard body in centimetres,
standing still.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.table_csv import csv_of
from fervor.recordings.table_jsonl import jsonl_of
from fervor.recordings.table_npz import npz_of
from fervor.rotations import IDENTITY, slerp, to_rpy
from fervor.skeletons.rig import CHILD_SEGMENT, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.standard_body import HIPS_ABOVE_GROUND_M, OFFSETS_M, TIPS_M, Offset

Array = npt.NDArray[np.float64]

_BVH_NAMES: Mapping[str, str] = {
    "pelvis": "Hips",
    "abdomen": "Spine",
    "thorax": "Chest",
    "head": "Head",
    "l_uparm": "LeftArm",
    "l_forearm": "LeftForeArm",
    "l_hand": "LeftHand",
    "r_uparm": "RightArm",
    "r_forearm": "RightForeArm",
    "r_hand": "RightHand",
    "l_thigh": "LeftUpLeg",
    "l_shank": "LeftLeg",
    "r_thigh": "RightUpLeg",
    "r_shank": "RightLeg",
}
_EVEN = 1e-6
"""Times are even where no step differs by more than this share from the mean."""


def write_recording(recording: Recording, path: Path | str) -> None:
    """Writes a recording; the suffix says how: .csv, .jsonl, .npz or .bvh.

    Raises:
        RecordingError: another suffix, or a file that can't be written.
    """
    path = Path(path)
    match path.suffix.lower():
        case ".csv":
            data = csv_of(recording).encode()
        case ".jsonl" | ".ndjson":
            data = jsonl_of(recording).encode()
        case ".npz":
            data = npz_of(recording)
        case ".bvh":
            data = bvh_of(recording).encode()
        case other:
            raise RecordingError(
                f"{path}: can't write {other or 'a file without suffix'}; expected csv, jsonl, npz, bvh"
            )
    try:
        path.write_bytes(data)
    except OSError as error:
        raise RecordingError(f"{path}: can't be written: {error.strerror or error}") from error


def bvh_of(recording: Recording) -> str:
    """A recording's canonical rotations as BVH, channels Z Y X in degrees.

    Raises:
        RecordingError: there is no frame.
    """
    times, local, observed = rig_poses(recording)
    if not len(times):
        raise RecordingError(f"{recording.name}: there is no frame; expected some motion")
    local, step = _on_even_grid(times, _held(local, observed))
    degrees = np.degrees(to_rpy(local))[..., ::-1]  # [frame, joint, 3] about Z, Y, X
    order = _tree_order()
    columns = np.array([CHILD_SEGMENT.index(segment) for segment in order if segment in CHILD_SEGMENT])
    turns = degrees[:, columns].reshape(len(local), -1)
    root = f"{_centimetres((0.0, HIPS_ABOVE_GROUND_M, 0.0))} 0 0 0"
    rows = [f"{root} {' '.join(f'{value:.9f}' for value in row)}" for row in turns.tolist()]
    head = ["HIERARCHY", *_node(0, 0), "MOTION", f"Frames: {len(rows)}", f"Frame Time: {step:.9g}"]
    return "\n".join([*head, *rows]) + "\n"


def _held(local: Array, observed: npt.NDArray[np.bool_]) -> Array:
    """Rotations [frame, joint, 4] in which unobserved joints keep their last pose; the identity before the first."""
    frames = np.arange(len(local))[:, None]
    last = np.maximum.accumulate(np.where(observed, frames, -1), axis=0)  # [frame, joint]
    held = np.take_along_axis(local, np.maximum(last, 0)[..., None], axis=0)
    return np.where(last[..., None] < 0, IDENTITY, held)


def _on_even_grid(times: Array, local: Array) -> tuple[Array, float]:
    """Rotations at even times, and the step between them in seconds."""
    if len(times) == 1:
        return local, 1.0 / 30.0
    steps = np.diff(times)
    mean = float(times[-1] - times[0]) / len(steps)
    if np.all(np.abs(steps - mean) <= _EVEN * mean):
        return local, mean
    step = float(np.median(steps))
    grid = np.arange(int((times[-1] - times[0]) / step + 1e-9) + 1) * step
    after = np.clip(np.searchsorted(times, grid, side="right"), 1, len(times) - 1)
    share = np.clip((grid - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    return slerp(local[after - 1], local[after], share[:, None]), step


def _children(segment: int) -> list[int]:
    return [below for above, below in zip(PARENT_SEGMENT, CHILD_SEGMENT, strict=True) if above == segment]


def _tree_order(segment: int = 0) -> list[int]:
    """Segments as a BVH lists them: each before what hangs on it."""
    return [segment, *(below for child in _children(segment) for below in _tree_order(child))]


def _node(segment: int, depth: int) -> list[str]:
    """The lines of a segment and all that hangs on it."""
    name, tab, deeper = SEGMENTS[segment], "\t" * depth, "\t" * (depth + 1)
    channels = "3 Zrotation Yrotation Xrotation"
    lines = [
        f"{tab}{'JOINT' if depth else 'ROOT'} {_BVH_NAMES[name]}",
        f"{tab}{{",
        f"{deeper}OFFSET {_centimetres(OFFSETS_M.get(name, (0.0, 0.0, 0.0)))}",
        f"{deeper}CHANNELS {channels if depth else f'6 Xposition Yposition Zposition {channels[2:]}'}",
    ]
    for child in _children(segment):
        lines += _node(child, depth + 1)
    if name in TIPS_M:
        lines += [f"{deeper}End Site", f"{deeper}{{", f"{deeper}\tOFFSET {_centimetres(TIPS_M[name])}", f"{deeper}}}"]
    return [*lines, f"{tab}}}"]


def _centimetres(offset: Offset) -> str:
    return " ".join(f"{100.0 * part:g}" for part in offset)
