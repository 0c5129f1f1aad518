"""Recordings as JSON lines."""

import json

import numpy as np
import pytest

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content
from fervor.recordings.table_jsonl import jsonl_of, parse_jsonl

REST = [0.0, 0.0, 0.0, 1.0]
LINES = [
    {"skeleton": "kinect_v2", "axes": "local", "quaternion": "wxyz", "joints": ["Neck", "SpineBase"]},
    {"t": 2.0, "q": [[1, 0, 0, 0], None]},
    {"t": 2.1, "q": [[0.5, 0.5, -0.5, 0.5], [1, 0, 0, 0]], "mask": [True, False]},
]


def read(*lines: object, skeleton: str | None = None) -> Recording:
    text = "\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines)
    return parse_jsonl(Content(text.encode(), "take.jsonl", "take"), skeleton)


def test_a_header_and_frames() -> None:
    recording = read(*LINES)
    neck, base = (recording.skeleton.joints.index(joint) for joint in ("Neck", "SpineBase"))
    assert recording.skeleton.name == "kinect_v2"
    assert recording.axes == "local"
    assert np.allclose(recording.times, [0, 0.1])
    assert np.array_equal(recording.rotations[:, neck], [REST, [0.5, -0.5, 0.5, 0.5]])
    assert recording.observed[:, neck].all()
    assert not recording.observed[:, base].any()


def test_a_recorded_conversation_is_a_recording() -> None:
    start = {"type": "session.start", "protocol": 1, **LINES[0]}
    frames = [
        {"type": "frame", "body": "a", "seq": seq, "emotion": "joy", **line} for seq, line in enumerate(LINES[1:])
    ]  # fmt: skip
    chatter = [{"type": "ping"}, {"type": "estimate", "t": 1.0, "intensity": 0.5}, {"type": "session.end"}]
    for sent in (frames, [{"type": "frames", "frames": frames}]):
        recording = read(start, chatter[0], "", *sent, *chatter)
        assert np.array_equal(recording.rotations, read(*LINES).rotations)


def test_without_a_header() -> None:
    recording = read({"t": 0, "q": [REST] * 13}, {"t": 1, "q": [REST] * 13}, skeleton="c13")
    assert recording.observed.all()


def test_a_rate_stands_for_times() -> None:
    recording = read({"skeleton": "c13", "rate_hz": 20}, {"q": [REST] * 13}, {"q": [REST] * 13})
    assert np.allclose(recording.times, [0, 0.05])


def test_positions() -> None:
    points = [[0.1 * index, index % 3, index % 5] for index in range(17)]
    recording = read({"skeleton": "coco17"}, {"t": 0, "p": points}, {"t": 1, "p": [None, *points[1:]]})
    assert recording.skeleton.name == "c13"
    assert recording.observed[:, 2].tolist() == [True, False]


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ([""], "no line has q or p; expected frames"),
        ([LINES[0]], "no line has q or p; expected frames"),
        (["{", LINES[1]], "line 1: not JSON"),
        ([LINES[0], "[1, 2]"], "line 2: expected a JSON object, found [1, 2]"),
        (["[" * 100_000], "line 1: not JSON"),
        ([*LINES, {"t": 3, "q": [[1, 0, 0, 0]]}], "line 4: 'q' does not fit; expected 2 joints as before"),
        ([*LINES, {"t": 3, "p": [[1, 0, 0], None]}], "line 4: 'q' does not fit"),
        ([LINES[0], {"t": 3, "q": []}], "line 2: 'q' does not fit; expected a list of joints"),
        ([LINES[0], {"t": 3, "q": "0001"}], "line 2: 'q' does not fit; expected a list of joints"),
        (
            [LINES[0], {"t": 3, "q": [[1, 0, 0], None]}],
            "line 2: expected 4 numbers or null for a joint, found [",
        ),
        ([LINES[0], {"t": 3, "q": [[1, 0, 0, "0"], None]}], "line 2: expected 4 numbers or null"),
        ([LINES[0], {"t": 3, "q": [[1, 0, 0, True], None]}], "line 2: expected 4 numbers or null"),
        ([LINES[0], {"t": 3, "q": [[10**400, 0, 0, 0], None]}], "line 2: expected 4 numbers or null"),
        ([*LINES, {"t": 3, "q": [None, None], "mask": [True]}], "line 4: 'mask' does not fit; expected 2 entries"),
        ([*LINES, {"q": [None, None]}], "line 4: expected seconds in 't', found None"),
        ([*LINES, {"t": "3", "q": [None, None]}], "line 4: expected seconds in 't', found 3"),
        ([*LINES, {"t": 2.1, "q": [None, None]}], "the time of frame 2 does not rise"),
        ([{**LINES[0], "joints": "Neck"}, LINES[1]], "expected a list of names in 'joints', found Neck"),
        ([{**LINES[0], "skeleton": 3}, LINES[1]], "expected a name in 'skeleton', found 3"),
        ([{**LINES[0], "rate_hz": "fast"}, LINES[1]], "expected a number for 'rate_hz', found fast"),
        ([LINES[0], {**LINES[1], "body": "a"}, {**LINES[2], "body": "b"}], "frames of several bodies"),
    ],
)
def test_a_broken_file_is_refused(lines: list[object], sentence: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(*lines)
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take.jsonl")


def test_what_is_written_can_be_read() -> None:
    recording = read({"t": 0, "q": [REST] * 13}, {"t": 0.3, "q": [None, *[REST] * 12]}, skeleton="c13")
    again = parse_jsonl(Content(jsonl_of(recording).encode(), "b.jsonl", "b"))
    assert np.array_equal(again.rotations[0], recording.rotations[0])
    assert np.array_equal(again.observed, recording.observed)
    assert np.array_equal(again.times, recording.times)
