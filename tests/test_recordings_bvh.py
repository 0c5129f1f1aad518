"""BVH files: real ones against an independent reading with scipy, odd ones, broken ones."""

import contextlib
import io
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings.bvh import MAX_DEPTH, MAX_JOINTS, read_bvh
from fervor.recordings.recording import Recording, rig_poses

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.exists() and not os.environ.get("CI"), reason="no real motion here")
FILES = ["100style/angry_reference", "100style/elated_reference", "100style/rushed_reference"] + [
    f"cmu/79_{take}" for take in (69, 70, 71)
]

Array = npt.NDArray[np.float64]

ARMS = """
  JOINT LeftArm { OFFSET 20 30 0 CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT LeftForeArm { OFFSET 30 0 0 CHANNELS 2 Xrotation Zrotation
      End Site { OFFSET 25 0 0 } } }
  JOINT RightArm { OFFSET -20 30 0 CHANNELS 3 Xrotation Yrotation Zrotation
    JOINT RightForeArm { OFFSET -30 0 0 CHANNELS 0
      End Site { OFFSET -25 0 0 } } }
"""
TREE = f"""HIERARCHY
ROOT Hips {{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation
{ARMS}
}}
"""
CHANNELS = 14
MOTION = "MOTION\nFrames: 2\nFrame Time: 0.02\n"
VALUES = [[0.5 * column + 100 * row for column in range(CHANNELS)] for row in range(2)]
ROWS = "\n".join(" ".join(map(str, row)) for row in VALUES)
WHOLE = f"{TREE}{MOTION}{ROWS}\n"


def read(text: str | bytes, name: str = "take") -> Recording:
    return read_bvh(io.BytesIO(text) if isinstance(text, bytes) else io.StringIO(text), name=name)


def same(a: Array, b: Array, tolerance: float = 1e-12) -> bool:
    return bool(np.all(np.minimum(np.abs(a - b).max(-1), np.abs(a + b).max(-1)) < tolerance))


def read_naively(path: Path) -> tuple[list[str], list[list[str]], Array, float]:
    """Names, rotation channels of each joint, values, frame time: for the well-formed files of the data folder."""
    names, channels = [], []
    lines = path.read_text().splitlines()
    for line in lines:
        words = line.split()
        if words[:1] in (["ROOT"], ["JOINT"]):
            names.append(words[1])
        if words[:1] == ["CHANNELS"]:
            channels.append(words[2:])
        if words[:1] == ["MOTION"]:
            break
    start = lines.index("MOTION")
    return names, channels, np.loadtxt(lines[start + 3 :]), float(lines[start + 2].split()[-1])


@needs_data
@pytest.mark.parametrize("file", FILES)
def test_real_files_agree_with_scipy(file: str) -> None:
    path = DATA / f"{file}.bvh"
    recording = read_bvh(path)
    names, channels, values, frame_time = read_naively(path)
    assert recording.name == path.stem
    assert recording.skeleton.joints == tuple(names)
    assert recording.axes == "local"
    assert np.allclose(recording.times, np.arange(len(values)) * frame_time, rtol=0, atol=1e-12)
    assert recording.rotations.shape == (len(values), len(names), 4)
    assert recording.observed.all()
    assert recording.rate_hz == pytest.approx(1 / frame_time)
    column = 0
    for joint, own in enumerate(channels):
        order = "".join(channel[0] for channel in own if channel.endswith("rotation"))
        angles = values[:, [column + i for i, channel in enumerate(own) if channel.endswith("rotation")]]
        column += len(own)
        assert same(recording.rotations[:, joint], Rotation.from_euler(order, angles, degrees=True).as_quat())


def test_every_joint_has_its_own_channels() -> None:
    recording = read(WHOLE)
    assert recording.name == "take"
    assert recording.skeleton.joints == ("Hips", "LeftArm", "LeftForeArm", "RightArm", "RightForeArm")
    assert recording.skeleton.parents == (-1, 0, 1, 0, 3)
    assert np.array_equal(recording.times, [0.0, 0.02])
    values = np.array(VALUES)
    expected = {
        "Hips": Rotation.from_euler("YXZ", values[:, 3:6], degrees=True),
        "LeftArm": Rotation.from_euler("ZYX", values[:, 6:9], degrees=True),
        "LeftForeArm": Rotation.from_euler("XZ", values[:, 9:11], degrees=True),
        "RightArm": Rotation.from_euler("XYZ", values[:, 11:14], degrees=True),
        "RightForeArm": Rotation.identity(2),
    }
    for joint, name in enumerate(recording.skeleton.joints):
        assert same(recording.rotations[:, joint], expected[name].as_quat())
    assert recording.observed.all()


def variants() -> dict[str, str | bytes]:
    flat = " ".join(ROWS.split())
    return {
        "crlf": WHOLE.replace("\n", "\r\n"),
        "old mac": WHOLE.replace("\n", "\r"),
        "tabs": WHOLE.replace(" ", "\t\t "),
        "blank lines": WHOLE.replace("\n", "\n\n  \n"),
        "byte order mark": b"\xef\xbb\xbf" + WHOLE.encode(),
        "bytes": WHOLE.encode(),
        "keywords in lower case": WHOLE.replace("HIERARCHY", "hierarchy").replace("OFFSET", "offset")
        .replace("CHANNELS", "channels").replace("rotation", "ROTATION").replace("JOINT", "joint")
        .replace("ROOT", "root").replace("End Site", "END SITE").replace("MOTION", "motion"),
        "one number a line": TREE + MOTION + "\n".join(ROWS.split()),
        "one line": TREE + MOTION + flat,
        "odd wrapping": TREE + MOTION + flat.replace(" 10", "\n\n10"),
        "no space after the colon": WHOLE.replace("Frames: ", "Frames:").replace("Time: ", "Time:"),
        "space before the colon": WHOLE.replace("Frames:", "Frames :").replace("Time:", "Time :"),
        "count on the next line": WHOLE.replace("Frames: ", "Frames:\n"),
        "scientific": TREE + MOTION + " ".join(f"{value:.17e}" for row in VALUES for value in row),
        "no line end": WHOLE.rstrip(),
        "braces without spaces": WHOLE.replace(" {", "{").replace("} }", "}}"),
        "fraction without zero": WHOLE.replace("0.02", ".02"),
    }  # fmt: skip


@pytest.mark.parametrize("variant", variants())
def test_the_same_file_in_other_clothes(variant: str) -> None:
    recording, plain = read(variants()[variant]), read(WHOLE)
    assert np.array_equal(recording.rotations, plain.rotations)
    assert np.array_equal(recording.times, plain.times)
    assert recording.skeleton.joints == plain.skeleton.joints


def test_a_joint_name_may_hold_spaces() -> None:
    assert read(WHOLE.replace("LeftArm", "my Left Arm")).skeleton.joints[1] == "my Left Arm"


def test_a_joint_may_have_several_end_sites_or_none() -> None:
    double = WHOLE.replace("End Site { OFFSET 25 0 0 }", "End Site { OFFSET 25 0 0 } End Site { OFFSET 0 5 0 }")
    none = WHOLE.replace("End Site { OFFSET 25 0 0 }", "")
    for text in (double, none):
        assert same(read(text).skeleton.bind, read(WHOLE).skeleton.bind)


def test_the_first_frame_is_kept() -> None:
    assert len(read(WHOLE)) == 2


def broken() -> dict[str, tuple[str | bytes, str]]:
    rows = ROWS.split()
    return {
        "empty": ("", "take, line 1: the file is empty"),
        "blank": (" \n\t\n", "take, line 1: the file is empty"),
        "not a BVH": ("time,joint\n1,2", "line 1: not a BVH file: expected HIERARCHY, found 'time,joint'"),
        "binary": (b"HIERARCHY\0\1\2", "take: the file is binary; expected text"),
        "noise": (bytes(range(128, 255)), "line 1: not a BVH file"),
        "only the first word": ("HIERARCHY", "line 1: the file ends where 'ROOT' was expected"),
        "no root": ("HIERARCHY\nJOINT a {", "line 2: expected 'ROOT', found 'JOINT'"),
        "header cut": (TREE[:150], "the file ends where"),
        "no motion": (TREE, "the file ends where 'MOTION' was expected"),
        "second root": (TREE + TREE[10:], "expected 'MOTION', found 'ROOT'"),
        "motion cut": (TREE + MOTION.replace(" 2", " 818") + "\n".join([ROWS.splitlines()[0]] * 417),
                       "the motion has 417 of 818 frames"),
        "last frame cut": (WHOLE.rstrip()[:-6], "the motion has 1 of 2 frames"),
        "too many": (WHOLE + "1 2 3", "the motion has more than its 2 frames"),
        "a word": (TREE + MOTION + " ".join(rows[:-1]) + "\nspam", "line 16: expected a finite number, found 'spam'"),
        "NaN": (TREE + MOTION + " ".join([*rows[:-1], "NaN"]), "line 15: expected a finite number, found 'NaN'"),
        "infinite": (TREE + MOTION + " ".join([*rows[:-1], "-inf"]), "expected a finite number, found '-inf'"),
        "too large": (TREE + MOTION + " ".join([*rows[:-1], "1e999"]), "expected a finite number, found '1e999'"),
        "underscore": (TREE + MOTION + " ".join([*rows[:-1], "1_0"]), "expected a finite number, found '1_0'"),
        "frame time 0": (WHOLE.replace("0.02", "0.0"), "line 14: expected a Frame Time over 0 seconds, found 0"),
        "frame time -1": (WHOLE.replace("0.02", "-1"), "expected a Frame Time over 0 seconds, found -1"),
        "frame time nan": (WHOLE.replace("0.02", "nan"), "expected 'Frame Time:' and a number"),
        "no frame time": (WHOLE.replace("Frame Time: 0.02\n", ""), "expected 'Frame Time:' and a number, found '0"),
        "no frames": (WHOLE.replace("Frames: 2", "Frames: 0"), "expected a whole number of Frames from 1, found 0"),
        "negative frames": (WHOLE.replace("Frames: 2", "Frames: -2"), "expected a whole number of Frames"),
        "half a frame": (WHOLE.replace("Frames: 2", "Frames: 2.5"), "expected a whole number of Frames"),
        "many frames": (WHOLE.replace("Frames: 2", "Frames: 9e15"), "the motion has 2 of 9000000000000000 frames"),
        "frames missing": (WHOLE.replace("Frames: 2\n", ""), "expected 'Frames:' and a number, found 'Frame Time"),
        "joint twice": (WHOLE.replace("RightArm", "LeftArm"), "line 7: the joint name 'LeftArm' appears twice"),
        "offset word": (WHOLE.replace("20 30 0", "20 x 0"), "line 4: expected a number of OFFSET, found 'x'"),
        "offset short": (WHOLE.replace("20 30 0", "20 30"), "expected a number of OFFSET, found 'CHANNELS'"),
        "offset nan": (WHOLE.replace("20 30 0", "20 nan 0"), "expected a number of OFFSET, found 'nan'"),
        "channel count": (WHOLE.replace("CHANNELS 2", "CHANNELS 7"), "expected 0 to 6 CHANNELS, found 7"),
        "channel count short": (WHOLE.replace("CHANNELS 2", "CHANNELS 1"), "expected OFFSET, CHANNELS, JOINT"),
        "channel name": (WHOLE.replace("2 Xrotation", "2 Wrotation"), "a channel such as Xrotation, found 'Wrotation'"),
        "channel twice": (WHOLE.replace("2 Xrotation", "2 Zrotation"), "has the channel Zrotation twice"),
        "channels twice": (WHOLE.replace("CHANNELS 0", "CHANNELS 0 CHANNELS 0"), "has CHANNELS twice"),
        "no brace": (WHOLE.replace("Hips {", "Hips\n"), "expected '{' after the joint 'Hips', found 'OFFSET'"),
        "brace missing": (WHOLE.replace("} } }\n  JOINT", "} }\n  JOINT"), "expected OFFSET, CHANNELS, JOINT"),
        "brace too many": (WHOLE.replace("MOTION", "} MOTION"), "expected 'MOTION', found '}'"),
        "end site": (WHOLE.replace("Site", "Sight"), "expected 'Site', found 'Sight'"),
        "no channels": ("HIERARCHY ROOT a { } MOTION Frames: 1\nFrame Time: 1\n", "no joint has any channels"),
        "no arms": (WHOLE.replace("RightForeArm", "Wing"), "take: no joint was found for r_forearm among Hips"),
        "too deep": ("HIERARCHY ROOT a {" + "".join(f" JOINT j{i} {{" for i in range(100_000)),
                     f"more than {MAX_DEPTH} joints inside each other"),
        "too many joints": ("HIERARCHY ROOT a {" + "".join(f" JOINT j{i} {{ }}" for i in range(MAX_JOINTS)),
                            f"more than {MAX_JOINTS} joints"),
    }  # fmt: skip


@pytest.mark.parametrize("case", broken())
def test_a_broken_file_is_refused_in_one_sentence(case: str) -> None:
    text, sentence = broken()[case]
    with pytest.raises(RecordingError) as caught:
        read(text)
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take")
    assert "\n" not in caught.value.message
    assert len(caught.value.message) < 600


@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(WHOLE)), st.integers(0, 12), st.text("{}09.-eE \n:JOINTxyz\0", max_size=6))
def test_no_damage_gives_anything_but_a_recording_or_its_error(start: int, cut: int, put: str) -> None:
    with contextlib.suppress(RecordingError):
        assert np.isfinite(read(WHOLE[:start] + put + WHOLE[start + cut :]).rotations).all()


@pytest.mark.parametrize("length", range(0, len(TREE), 5))
def test_a_truncated_header_is_refused(length: int) -> None:
    with pytest.raises(RecordingError):
        read(WHOLE[:length])


def test_files_are_named_in_errors(tmp_path: Path) -> None:
    path = tmp_path / "walk.bvh"
    with pytest.raises(RecordingError, match=r"walk\.bvh: can't be read: No such file"):
        read_bvh(path)
    path.write_text(WHOLE.replace("0.02", "0"))
    with pytest.raises(RecordingError, match=r"walk\.bvh, line 14: expected a Frame Time"):
        read_bvh(str(path))
    path.write_text(WHOLE)
    assert read_bvh(path).name == "walk"
    with path.open() as stream:
        assert read_bvh(stream).name == "walk"
    with pytest.raises(RecordingError, match="can't be read"):
        read_bvh(tmp_path)


def test_a_map_of_segments_helps_with_unknown_names() -> None:
    text = WHOLE.replace("RightForeArm", "Wing")
    recording = read_bvh(io.StringIO(text), name="bird", segments={"r_forearm": "Wing"})
    times, local, observed = rig_poses(recording)
    assert times.shape == (2,)
    assert local.shape == (2, 13, 4)
    assert observed[0].sum() == 4  # shoulders and elbows; arms hang on the hips


def test_a_recording_knows_its_rate_and_length() -> None:
    recording = read(WHOLE)
    assert recording.rate_hz == pytest.approx(50.0)
    assert recording.duration_s == pytest.approx(0.02)
