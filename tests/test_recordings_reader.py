"""One door for all kinds of files."""

import io
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.writer import write_recording
from fervor.skeletons.catalog import skeleton

MVNX = """<?xml version="1.0"?><mvnx><subject frameRate="60"><frames><frame index="0" type="normal">
<orientation>{}</orientation></frame></frames></subject></mvnx>""".format("1 0 0 0 " * 23)


def recording() -> Recording:
    turns = Rotation.random(6 * 13, random_state=0).as_quat().reshape(6, 13, 4)
    return Recording("take", skeleton("c13"), np.arange(6) / 30, turns, np.ones((6, 13), np.bool_), "local")


@pytest.fixture(params=["bvh", "csv", "jsonl", "npz", "mvnx"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / f"take.{request.param}"
    if request.param == "mvnx":
        path.write_text(MVNX)
    else:
        write_recording(recording(), path)
    return path


def test_the_suffix_tells(file: Path) -> None:
    found = read_recording(file)
    assert found.name == "take"
    assert len(found) == (1 if file.suffix == ".mvnx" else 6)
    assert len(read_recording(str(file))) == len(found)


def test_the_content_tells_where_the_suffix_does_not(file: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    bare.write_bytes(file.read_bytes())
    assert np.array_equal(rig_poses(read_recording(bare))[1], rig_poses(read_recording(file))[1])
    stream = io.BytesIO(file.read_bytes())
    assert read_recording(stream, name="upload").name == "upload"
    with file.open("rb") as opened:
        assert read_recording(opened).name == "take"


def test_upper_case_suffixes(file: Path, tmp_path: Path) -> None:
    shouting = tmp_path / f"TAKE{file.suffix.upper()}"
    shouting.write_bytes(file.read_bytes())
    assert read_recording(shouting).name == "TAKE"


def test_options_must_suit_the_kind(file: Path) -> None:
    if file.suffix in (".bvh", ".mvnx"):
        with pytest.raises(RecordingError, match=r"files bring their own skeleton; expected none"):
            read_recording(file, skeleton="kinect_v2")
    else:
        assert read_recording(file, skeleton="c13").skeleton is skeleton("c13")
        assert read_recording(file, skeleton=skeleton("c13")).skeleton is skeleton("c13")
    if file.suffix == ".bvh":
        assert read_recording(file, segments={"head": None}).skeleton.drives[3] is None
    else:
        with pytest.raises(RecordingError, match="segments are for BVH files"):
            read_recording(file, segments={"head": "Head"})


@pytest.mark.parametrize(
    ("data", "name", "sentence"),
    [
        (b"", "", "not a recording; expected BVH, MVNX, CSV, JSONL or NPZ"),
        (b"hello", "notes.txt", "notes.txt: not a recording; expected BVH"),
        (b"\x89PNG\r\n", "picture", "picture: not a recording"),
        (b"hello", "notes.bvh", "notes.bvh, line 1: not a BVH file"),
        (b"{}", "a.npz", "a.npz: not an NPZ file"),
        (b"<svg/>", "", "not an MVNX file"),
    ],
)
def test_other_files_are_refused(data: bytes, name: str, sentence: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read_recording(io.BytesIO(data), name=name or None)
    assert sentence in caught.value.message


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"nothing\.bvh: can't be read: No such file"):
        read_recording(tmp_path / "nothing.bvh")


def test_text_streams_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "noise.bvh"
    path.write_bytes(bytes(range(128, 255)))
    with (
        path.open(encoding="utf-8") as stream,
        pytest.raises(RecordingError, match="the file is binary"),
    ):
        read_recording(stream)
