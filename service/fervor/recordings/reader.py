"""Reads any recording: which kind a file is of is told by its suffix, or else by its content."""

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import IO, Any, Literal

from fervor.errors import RecordingError
from fervor.recordings.bvh import parse_bvh
from fervor.recordings.mvnx import parse_mvnx
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content, read_content
from fervor.recordings.table_csv import parse_csv
from fervor.recordings.table_jsonl import parse_jsonl
from fervor.recordings.table_npz import parse_npz
from fervor.skeletons.skeleton import Skeleton

Kind = Literal["bvh", "mvnx", "csv", "jsonl", "npz"]

SUFFIXES: Mapping[str, Kind] = {
    ".bvh": "bvh",
    ".mvnx": "mvnx",
    ".csv": "csv",
    ".tsv": "csv",
    ".jsonl": "jsonl",
    ".ndjson": "jsonl",
    ".npz": "npz",
}
"""Kinds of files by their suffix."""


def read_recording(
    source: Path | str | IO[Any],
    *,
    name: str | None = None,
    skeleton: str | Skeleton | None = None,
    segments: Mapping[str, str | None] | None = None,
) -> Recording:
    """Reads a BVH, MVNX, CSV, JSONL or NPZ file.

    Args:
        source: a path, or an open text or binary stream.
        name: of the recording; by default the file's name without suffix.
        skeleton: for CSV, JSONL and NPZ: a skeleton, or the name of a skeleton or landmark sensor.
        segments: for BVH: joint names of rig segments, where they can't be recognised; None for one to leave unseen.

    Raises:
        RecordingError: the file can't be used, or an option does not suit its kind; the sentence says why.
    """
    content = read_content(source, name)
    kind = kind_of(content)
    brings_its_own = kind in ("bvh", "mvnx")
    if brings_its_own and skeleton is not None:
        hint = "; name joints with segments instead" if kind == "bvh" else ""
        raise RecordingError(f"{content.label}: {kind.upper()} files bring their own skeleton; expected none{hint}")
    if kind != "bvh" and segments:
        raise RecordingError(f"{content.label}: segments are for BVH files; expected none for {kind.upper()}")
    match kind:
        case "bvh":
            return parse_bvh(content, segments=segments)
        case "mvnx":
            return parse_mvnx(content)
        case "csv":
            return parse_csv(content, skeleton)
        case "jsonl":
            return parse_jsonl(content, skeleton)
        case "npz":
            return parse_npz(content, skeleton)


def kind_of(content: Content) -> Kind:
    """Which kind of file a content is.

    Raises:
        RecordingError: none that is known.
    """
    known = SUFFIXES.get(PurePath(content.label).suffix.lower())
    if known is not None:
        return known
    start = content.data[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    if start[:9].upper() == b"HIERARCHY":
        return "bvh"
    if start[:4] == b"PK\x03\x04":
        return "npz"
    if start[:1] == b"{":
        return "jsonl"
    if start[:1] == b"<":
        return "mvnx"
    first = start.splitlines()[0] if start else b""
    if first.startswith(b"#") or b".x" in first.lower():
        return "csv"
    raise RecordingError(f"{content.label}: not a recording; expected BVH, MVNX, CSV, JSONL or NPZ")
