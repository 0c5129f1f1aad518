"""Recordings as CSV: one row a frame, one column a number.

    # skeleton: kinect_v2
    # axes: global
    t,SpineBase.x,SpineBase.y,SpineBase.z,SpineBase.w,SpineMid.x,…
    0.0,0,0,0,1,…

Columns `<joint>.x`, `.y`, `.z`, `.w` hold quaternions, without `.w` positions; `t` (or `time`) holds seconds. Columns
of any other name are ignored. Comment lines before the names say `skeleton`, `axes` and, where there is no `t`,
`rate_hz`. An empty cell is a joint that was not tracked. Fields are separated by commas, semicolons or tabs.
"""

import csv
import io

import numpy as np
import numpy.typing as npt

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.source import Content
from fervor.recordings.tabular import Table, to_recording
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.skeleton import Skeleton

_TIMES = ("t", "time")
_SUFFIXES = {".x": 0, ".y": 1, ".z": 2, ".w": 3}


def parse_csv(content: Content, skeleton: str | Skeleton | None = None) -> Recording:
    """The recording in a CSV file.

    Raises:
        RecordingError: the file can't be used; the sentence says where and why.
    """
    lines = content.text.splitlines()
    notes: dict[str, str] = {}
    first = 0
    while first < len(lines) and (lines[first].startswith("#") or not lines[first].strip()):
        key, _, value = lines[first].lstrip("#").partition(":")
        notes[key.strip().lower()] = value.strip()
        first += 1
    if first == len(lines):
        raise RecordingError(f"{content.label}, line 1: the file is empty; expected a line of column names")
    delimiter = max(",;\t", key=lines[first].count)
    names, *rows = csv.reader(lines[first:], delimiter=delimiter)
    columns = _columns(content.label, [name.strip() for name in names], first + 1)
    times = [index for index, name in enumerate(names) if name.strip().lower() in _TIMES][:1]
    wanted = times + [index for parts in columns.values() for index in parts]
    numbers = _numbers(content.label, rows, len(names), wanted, first + 2)
    table = Table(
        label=content.label,
        name=content.name,
        values=numbers[:, np.array(list(columns.values()))],
        times=numbers[:, times[0]] if times else None,
        rate_hz=_rate(content.label, notes.get("rate_hz")),
        joints=tuple(columns),
        skeleton=notes.get("skeleton"),
        axes=notes.get("axes"),
        quaternion="xyzw",
    )
    return to_recording(table, skeleton)


def _columns(label: str, names: list[str], line: int) -> dict[str, list[int]]:
    """Columns of each joint, in the order x, y, z, w."""
    found: dict[str, dict[int, int]] = {}
    for index, name in enumerate(names):
        joint, suffix = name[:-2], name[-2:].lower()
        if joint and suffix in _SUFFIXES:
            if _SUFFIXES[suffix] in found.setdefault(joint, {}):
                raise RecordingError(f"{label}, line {line}: the column {name!r} appears twice")
            found[joint][_SUFFIXES[suffix]] = index
    widths = {tuple(sorted(parts)) for parts in found.values()}
    if widths not in ({(0, 1, 2, 3)}, {(0, 1, 2)}):
        raise RecordingError(
            f"{label}, line {line}: expected columns <joint>.x .y .z .w for every joint, or .x .y .z for every joint"
        )
    return {joint: [parts[part] for part in sorted(parts)] for joint, parts in found.items()}


def _numbers(label: str, rows: list[list[str]], width: int, wanted: list[int], first: int) -> npt.NDArray[np.float64]:
    """The cells of the wanted columns as numbers [row, column]; all else, and empty cells, are NaN."""
    numbers = np.full((len(rows), width), np.nan)
    kept = 0
    for line, row in enumerate(rows, start=first):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != width:
            raise RecordingError(f"{label}, line {line}: {len(row)} fields; expected {width} as in the column names")
        try:
            numbers[kept, wanted] = [float(row[column].strip() or "nan") for column in wanted]
        except ValueError as error:
            raise RecordingError(f"{label}, line {line}: expected a number ({error})") from None
        kept += 1
    return numbers[:kept]


def _rate(label: str, text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        raise RecordingError(f"{label}: expected a number for rate_hz, found {text!r}") from None


def csv_of(recording: Recording) -> str:
    """A recording's canonical rotations as CSV; unobserved joints are empty cells."""
    times, local, observed = rig_poses(recording)
    out = io.StringIO()
    out.write("# skeleton: c13\n# axes: local\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["t", *(f"{joint}{suffix}" for joint in JOINTS for suffix in _SUFFIXES)])
    for time, pose, seen in zip(times.tolist(), local.tolist(), observed.tolist(), strict=True):
        cells = [cell for q, here in zip(pose, seen, strict=True) for cell in (q if here else [""] * 4)]
        writer.writerow([repr(time), *(cell if cell == "" else repr(cell) for cell in cells)])
    return out.getvalue()
