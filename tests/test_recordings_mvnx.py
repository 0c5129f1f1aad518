"""MVNX files written here in MVN's layout: the motion comes back whatever the heading and the segments' axes."""

import io
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings.mvnx import CHUNK, read_mvnx
from fervor.recordings.recording import Recording, rig_poses
from suits import XSENS, Array, Person, mvnx


def motion(frames: int = 20, seed: int = 0) -> Array:
    return Rotation.random(frames * 13, random_state=seed).as_quat().reshape(frames, 13, 4)


def read(text: str | bytes) -> Recording:
    return read_mvnx(io.BytesIO(text if isinstance(text, bytes) else text.encode()), name="take")


def apart(a: Array, b: Array) -> float:
    return float((Rotation.from_quat(a.reshape(-1, 4)).inv() * Rotation.from_quat(b.reshape(-1, 4))).magnitude().max())


@pytest.mark.parametrize("heading", [0.0, 30.0, -135.0, 180.0])
@pytest.mark.parametrize("poses", [("identity", "tpose", "tpose-isb"), ("npose",), ("identity", "npose", "tpose")])
def test_the_motion_comes_back(heading: float, poses: tuple[str, ...]) -> None:
    truth = motion()
    recording = read(mvnx(truth, Person(heading=heading, plain_axes=False), poses=poses))
    times, local, observed = rig_poses(recording)
    assert observed.all()
    assert apart(local, truth) < 1e-9
    assert np.allclose(times, np.arange(20) / 240, rtol=0, atol=1e-12)
    assert recording.rate_hz == pytest.approx(240)
    assert recording.skeleton.name == "xsens_mvn"
    assert recording.axes == "global"
    assert recording.name == "take"


def test_without_a_reference_pose_the_catalogue_holds() -> None:
    truth = motion()
    recording = read(mvnx(truth, Person(), poses=("identity",)))
    assert recording.skeleton is XSENS
    assert apart(rig_poses(recording)[1], truth) < 1e-9


@pytest.mark.parametrize(
    "options",
    [
        {"namespace": False},
        {"name_segments": False},
        {"labels": [*reversed(XSENS.joints)]},
        {"labels": [*XSENS.joints, "Prop1"]},
        {"stamp": 'time="{time}"'},
        {"rate": "", "stamp": 'time="{time}"'},
        {"stamp": ""},
    ],
)
def test_the_same_motion_in_other_clothes(options: dict[str, object]) -> None:
    truth = motion()
    times, local, _ = rig_poses(read(mvnx(truth, Person(heading=20), **options)))  # type: ignore[arg-type]
    assert apart(local, truth) < 1e-9
    assert np.allclose(times, np.arange(20) / 240, rtol=0, atol=6e-4)


def test_missing_frames_leave_a_gap_in_the_times() -> None:
    text = mvnx(motion(), Person())
    lines = [line for line in text.splitlines() if 'index="9"' not in line]
    times = read("\n".join(lines)).times
    assert len(times) == 19
    assert np.diff(times).max() == pytest.approx(2 / 240)


def test_segments_that_are_missing_are_unseen() -> None:
    upper = [joint for joint in XSENS.joints if "Leg" not in joint and "Foot" not in joint and "Toe" not in joint]
    truth = motion()
    _, local, observed = rig_poses(read(mvnx(truth, Person(), labels=upper)))
    assert observed[:, :9].all()
    assert not observed[:, 9:].any()
    assert apart(local[:, :9], truth[:, :9]) < 1e-9


WHOLE = mvnx(motion(3), Person())


def broken() -> dict[str, tuple[str | bytes, str]]:
    start, normal = 'type="normal"><orientation>', WHOLE.index('type="normal"')
    first = WHOLE[normal + len(start) :].split()[0]

    def damaged(put: str) -> str:
        return WHOLE[:normal] + WHOLE[normal:].replace(start + first, start + put, 1)

    head = WHOLE[: WHOLE.index("<frames")]
    return {
        "empty": ("", "take, line 1: not well-formed XML (no element found)"),
        "not XML": ("HIERARCHY", "take, line 1: not well-formed XML"),
        "binary": (b"\x89PNG\0\0", "not well-formed XML"),
        "other XML": ("<html><body/></html>", "take: not an MVNX file: expected <mvnx>, found <html>"),
        "cut": (WHOLE[: len(WHOLE) // 2], "not well-formed XML"),
        "doctype": (WHOLE.replace("<mvnx", "<!DOCTYPE mvnx><mvnx", 1), "the file has a DOCTYPE; expected none"),
        "late doctype": ("<?xml version='1.0'?>" + " " * 2 * CHUNK + "<!DOCTYPE mvnx []><mvnx/>", "has a DOCTYPE"),
        "utf-16 doctype": ('<?xml version="1.0" encoding="utf-16"?><!DOCTYPE x><mvnx/>'.encode("utf-16"), "DOCTYPE"),
        "no frames": (head + "</subject></mvnx>", "no frame of type normal"),
        "only a pose": (WHOLE.replace('type="normal"', 'type="tpose"'), "no frame of type normal"),
        "no orientation": (WHOLE.replace("orientation>", "x>"), "frame 0 has 0 numbers in <orientation>; expected 92"),
        "few numbers": (damaged(""), "frame 0 has 91 numbers in <orientation>; expected 92"),
        "a word": (damaged("spam"), "frame 0 holds something else than finite numbers"),
        "NaN": (damaged("NaN"), "frame 0 holds something else than finite numbers"),
        "no arm": (WHOLE.replace('"LeftForeArm"', '"Wing"'), "no segment LeftForeArm among Pelvis, L5"),
        "no times": (WHOLE.replace("frameRate", "rate").replace("time=", "clock="), "nor rising times"),
        "same index": (WHOLE.replace('index="6"', 'index="5"').replace("time=", "clock="), "nor rising times"),
        "unknown encoding": (WHOLE.replace("UTF-8", "KLINGON").encode(), "not well-formed XML"),
        "bad tpose": (WHOLE.replace('type="tpose"><orientation>', 'type="tpose"><orientation>1 '),
                      "the frame of type tpose has 93 numbers"),
    }  # fmt: skip


@pytest.mark.parametrize("case", broken())
def test_a_broken_file_is_refused_in_one_sentence(case: str) -> None:
    text, sentence = broken()[case]
    with pytest.raises(RecordingError) as caught:
        read(text)
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take")
    assert "\n" not in caught.value.message


def test_a_bomb_of_entities_goes_off_nowhere() -> None:
    entities = '<!ENTITY a "ha">' + "".join(
        f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 50}">' for i in range(12)
    )  # fmt: skip
    with pytest.raises(RecordingError, match="DOCTYPE"):
        read(f"<!DOCTYPE mvnx [{entities}]><mvnx>&m;</mvnx>")
    with pytest.raises(RecordingError, match="DOCTYPE"):  # in an encoding that hides it from a search of the bytes
        read(f"<!DOCTYPE mvnx [{entities}]><mvnx>&m;</mvnx>".encode("utf-16"))


def test_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "dance.mvnx"
    path.write_text(WHOLE)
    assert read_mvnx(path).name == "dance"
    path.write_text(WHOLE.replace("</subject>", ""))
    with pytest.raises(RecordingError, match=r"dance\.mvnx, line \d+: not well-formed XML \(mismatched tag\)"):
        read_mvnx(path)
