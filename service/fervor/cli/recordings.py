"""Reading a recording as the options of a command say: whose skeleton it is in, which joints are what.

`--skeleton` is a name as in /v1/skeletons, or the path of a JSON file with a `SkeletonSpec`, such as `fervor calibrate`
writes. A BVH or MVNX file brings its own skeleton; a JSON file with the same joints replaces its alignment.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from fervor.errors import InputError, RecordingError
from fervor.protocol.codec import one_sentence
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.recordings.reader import SUFFIXES, read_recording
from fervor.recordings.recording import Recording
from fervor.skeletons.skeleton import Skeleton

_Segments: TypeAdapter[dict[str, str | None]] = TypeAdapter(dict[str, str | None])


def read(file: Path, *, skeleton: str | None = None, segments: Path | None = None) -> Recording:
    """The recording in a file.

    Args:
        file: BVH, MVNX, CSV, JSONL or NPZ.
        skeleton: a name, or the path of a JSON file.
        segments: for BVH: a JSON file that maps rig segments to joints.

    Raises:
        InputError: a file can't be used, or the skeleton is not that of the recording.
    """
    known = find_skeleton(skeleton)
    if isinstance(known, Skeleton) and SUFFIXES.get(file.suffix.lower()) in ("bvh", "mvnx"):
        recording = read_recording(file, segments=read_segments(segments))
        if recording.skeleton.joints != known.joints:
            raise RecordingError(f"{file}: its joints are not those of skeleton {known.name!r}; expected the same")
        return replace(recording, skeleton=known)
    return read_recording(file, skeleton=known, segments=read_segments(segments))


def find_skeleton(said: str | None) -> str | Skeleton | None:
    """What `--skeleton` says: a name, which the reader looks up, or the skeleton in a JSON file.

    Raises:
        InputError: the JSON file can't be read as a skeleton.
    """
    if said is None or Path(said).suffix.lower() != ".json":
        return said
    path = Path(said)
    try:
        return SkeletonSpec.model_validate_json(_read(path)).to_skeleton()
    except ValidationError as error:
        raise InputError(f"{path}: not a skeleton: {one_sentence(error)}") from None


def read_segments(path: Path | None) -> Mapping[str, str | None] | None:
    """The map of rig segments to joint names in a JSON file; null for a segment to leave unseen.

    Raises:
        InputError: it can't be read as one.
    """
    if path is None:
        return None
    try:
        return _Segments.validate_json(_read(path))
    except ValidationError as error:
        raise InputError(f"{path}: not a map of segments to joints: {one_sentence(error)}") from None


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't be read: {error.strerror or error}") from None
