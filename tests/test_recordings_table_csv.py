"""Recordings as CSV."""

import numpy as np
import pytest

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content
from fervor.recordings.table_csv import csv_of, parse_csv

TEXT = """# skeleton: kinect_v2
# axes: local

t,label,SpineBase.x,SpineBase.y,SpineBase.z,SpineBase.w,Neck.w,Neck.z,Neck.y,Neck.x
1.5,joy,0,0,0,1,0.5,0.5,-0.5,0.5
1.6,joy,,,,,1,0,0,0

1.75,"sad, very",0.6,0.0,8e-1,0,1,0,0,nan
"""


def read(text: str | bytes, skeleton: str | None = None) -> Recording:
    return parse_csv(Content(text if isinstance(text, bytes) else text.encode(), "take.csv", "take"), skeleton)


def test_columns_are_found_by_name() -> None:
    recording = read(TEXT)
    joints = recording.skeleton.joints
    base, neck = joints.index("SpineBase"), joints.index("Neck")
    assert recording.skeleton.name == "kinect_v2"
    assert recording.axes == "local"
    assert np.allclose(recording.times, [0, 0.1, 0.25])
    assert np.array_equal(recording.rotations[2, base], [0.6, 0, 0.8, 0])
    assert np.array_equal(recording.rotations[0, neck], [0.5, -0.5, 0.5, 0.5])
    assert recording.observed[:, base].tolist() == [True, False, True]
    assert recording.observed[:, neck].tolist() == [True, True, False]
    assert recording.observed.sum() == 4


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_delimiters(delimiter: str) -> None:
    text = TEXT.replace('"sad, very"', "sad").replace(",", delimiter)
    assert np.array_equal(read(text).rotations, read(TEXT).rotations)


def test_clothes_do_not_matter() -> None:
    plain = read(TEXT)
    for text in (TEXT.replace("\n", "\r\n"), "\ufeff" + TEXT, TEXT.replace("t,label", " T , label")):
        assert np.array_equal(read(text).rotations, plain.rotations)
        assert np.array_equal(read(text).times, plain.times)


def test_a_rate_stands_for_times() -> None:
    text = "# rate_hz: 25\nhead.x,head.y,head.z,head.w\n0,0,0,1\n0,0,1,0\n"
    recording = read(text, "c13")
    assert np.allclose(recording.times, [0, 0.04])


def test_positions() -> None:
    names = ("nose", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
    places = ((0, 0.9, 0.1), (0.1, 0.9, 0), (-0.1, 0.9, 0), (0.2, 0.6, 0), (-0.2, 0.6, 0), (0.1, 0, 0), (-0.1, 0, 0))
    header = ",".join(f"{name}.{axis}" for name in names for axis in "xyz")
    row = ",".join(str(value) for place in places for value in place)
    recording = read(f"time,{header}\n0,{row}\n", "mediapipe")
    assert recording.skeleton.name == "c13"
    assert recording.observed.tolist() == [[True] * 3 + [False] * 10]
    assert np.allclose(np.abs(recording.rotations[..., 3]), 1.0)
    assert np.array_equal(read(f"time,{header}\n0,{row}\n").rotations, recording.rotations)  # by the points' names


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "line 1: the file is empty"),
        ("# skeleton: c13\n", "line 1: the file is empty"),
        ("t,a\n1,2\n", "line 1: expected columns <joint>.x .y .z .w for every joint"),
        ("t,head.x,head.y\n1,2,3\n", "expected columns <joint>.x"),
        ("t,head.x,head.y,head.z,head.w,spine.x,spine.y,spine.z\n", "expected columns <joint>.x"),
        ("t,head.x,head.x,head.y,head.z,head.w\n", "line 1: the column 'head.x' appears twice"),
        ("t,head.x,head.y,head.z,head.w\n", "numbers have the shape [0, 1, 4]"),
        ("t,head.x,head.y,head.z,head.w\n0,0,0,0,1\n1,2\n", "line 3: 2 fields; expected 5 as in the column names"),
        ("# x\nt,head.x,head.y,head.z,head.w\n0,0,0,spam,1\n", "line 3: expected a number (could not convert"),
        ("t,head.x,head.y,head.z,head.w\n0,0,0,0,1\n0,0,0,0,1\n", "the time of frame 1 does not rise"),
        ("t,head.x,head.y,head.z,head.w\n0,0,0,inf,1\n", "frame 0 holds an infinite number"),
        ("# rate_hz: fast\nhead.x,head.y,head.z,head.w\n0,0,0,1\n", "expected a number for rate_hz, found 'fast'"),
        (b"t,head.x\0\n", "the file is binary; expected text"),
    ],
)
def test_a_broken_file_is_refused(text: str | bytes, sentence: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(text, "c13")
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take.csv")


def test_what_is_written_can_be_read() -> None:
    again = read(csv_of(read(TEXT, "kinect_v2")))
    assert again.skeleton.name == "c13"
    assert np.allclose(again.times, [0, 0.1, 0.25])
