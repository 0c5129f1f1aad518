"""`fervor calibrate`: a held pose in a file gives a skeleton that commands, sessions and services take."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bodies import motion
from fervor.cli.main import run
from fervor.protocol.messages import SessionStart
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.writer import write_recording
from fervor.rotations import angle_between
from fervor.server.kept_skeletons import load_skeletons
from fervor.skeletons.canonical import C13
from fervor.skeletons.catalog import skeleton
from live import Live, frames_of, talk
from sensors import rendered, t_pose

RATE = 30
N_POSE = np.tile([0.0, 0.0, 0.0, 1.0], (13, 1))
SOURCE = skeleton("kinect_v2")
CAMERA = Rotation.from_euler("YX", [170, 20], degrees=True)
"""The person stands before a camera that looks down a little."""
UP, FORWARD = (CAMERA.apply(axis) for axis in ([0, 1, 0], [0, 0, 1]))


def stranger(local: np.ndarray, *, trembling: float = 0.0, seed: int = 3) -> np.ndarray:
    """[frame, joint, 4]: a Kinect whose joints' axes are turned against the documented ones, each in its own way."""
    sent = Rotation.from_quat(rendered(SOURCE, local, CAMERA).reshape(-1, 4))
    frames, joints = len(local), len(SOURCE.joints)
    axes = Rotation.random(joints, random_state=seed)
    shaken = np.random.default_rng(seed).normal(0.0, trembling, (frames * joints, 3))
    turned = sent * axes[np.tile(np.arange(joints), frames)] * Rotation.from_rotvec(shaken)
    return turned.as_quat().reshape(frames, joints, 4)


def moving_around(held: np.ndarray) -> np.ndarray:
    """Two seconds of motion, one and a half of a held pose, then motion again: [frame, 13, 4]."""
    return np.concatenate([motion(60), np.tile(held, (45, 1, 1)), motion(60, seed=1)])


def write_lab(path: Path, *, pose: str = "n", trembling: float = 0.0, lost: tuple[str, ...] = ()) -> Path:
    """A recording of the strange Kinect."""
    sent = stranger(moving_around(t_pose() if pose == "t" else N_POSE), trembling=trembling)
    lines = [json.dumps({"skeleton": "kinect_v2"})]
    for number, rotations in enumerate(sent.tolist()):
        q = [None if joint in lost else turn for joint, turn in zip(SOURCE.joints, rotations, strict=True)]
        lines.append(json.dumps({"t": number / RATE, "q": q}))
    path.write_text("\n".join(lines))
    return path


def calibrate(file: Path, *more: str, pose: str = "n", start: str = "2.1") -> tuple[int, Path]:
    out = file.with_name("lab.json")
    toward = ["--up", ",".join(map(str, UP)), "--forward", ",".join(map(str, FORWARD))]
    return run(["calibrate", str(file), "--pose", pose, "--start", start, "--out", str(out), *toward, *more]), out


@pytest.mark.parametrize("pose", ["n", "t"])
def test_the_motion_comes_back(pose: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, lab = calibrate(write_lab(tmp_path / "take.jsonl", pose=pose), pose=pose)
    assert code == 0
    said = capsys.readouterr().out.splitlines()
    assert said == [
        "31 frames, at most 0.0 degrees from the mean, unseen: none",
        f"{lab}: skeleton 'lab' with 25 joints",
    ]
    out = tmp_path / "out.npz"
    assert run(["convert", str(tmp_path / "take.jsonl"), str(out), "--skeleton", str(lab)]) == 0
    _, local, seen = rig_poses(read_recording(out))
    assert seen.all()
    assert angle_between(local[:60], motion(60)).max() < 1e-7
    wrong = rig_poses(read_recording(tmp_path / "take.jsonl"))[1]
    assert angle_between(wrong[:60], motion(60)).max() > 1.0, "without it, it would not"


def test_trembling_and_unseen_segments_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, lab = calibrate(
        write_lab(tmp_path / "take.jsonl", trembling=0.02, lost=("HandLeft", "HandRight")), "--name", "hall"
    )
    assert code == 0
    said = capsys.readouterr().out
    spread = float(said.split("at most ")[1].split()[0])
    assert 1.0 < spread < 8.0
    assert "unseen: l_hand, r_hand\n" in said
    assert SkeletonSpec.model_validate_json(lab.read_text()).name == "hall"


async def test_a_session_and_a_service_take_it(tmp_path: Path, live: Live) -> None:
    code, lab = calibrate(write_lab(tmp_path / "take.jsonl"))
    assert code == 0
    spec = json.loads(lab.read_text())
    SessionStart(skeleton=spec)
    assert load_skeletons(tmp_path)["lab"].joints == SOURCE.joints
    poses = motion(60)
    heard = []
    for name, sent in ((spec, stranger(poses)), ("c13", poses)):
        async with talk(live) as stream:
            await stream.start(skeleton=name, emotion="joy")
            heard.append([estimate["intensity"] for estimate in await stream.follow(frames_of(sent, rate_hz=30))])
    assert np.abs(np.subtract(*heard)).max() < 1e-4


def test_a_bvh_is_calibrated_too(tmp_path: Path) -> None:
    """Its zero pose is an N, somebody holds a T: what was known of it before comes out again."""
    poses = moving_around(t_pose())
    take = Recording("take", C13, np.arange(len(poses)) / RATE, poses, np.ones(poses.shape[:2], np.bool_), "local")
    bvh, lab, out = tmp_path / "take.bvh", tmp_path / "lab.json", tmp_path / "out.npz"
    write_recording(take, bvh)
    assert run(["calibrate", str(bvh), "--pose", "t", "--start", "2.1", "--out", str(lab)]) == 0
    assert run(["convert", str(bvh), str(out), "--skeleton", str(lab)]) == 0
    assert angle_between(rig_poses(read_recording(out))[1], poses).max() < 1e-6


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (["--start", "0"], "the pose was not held still"),
        (["--start", "5.2"], "take ends after 5.5 s; expected a pose that is held until 6.2 s"),
        (["--up", "0,1"], "--up is '0,1'; expected three numbers"),
        (["--up", "0,1,0", "--forward", "0,2,0"], "span no plane"),
        (["--name", "x" * 65], "can't be the name of a skeleton"),
        (["--out", "folder/lab.json"], "can't be written"),
        (["--skeleton", "c13"], "has 13 joints"),
    ],
)
def test_what_can_not_be_is_one_sentence(
    more: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, lab = calibrate(write_lab(tmp_path / "take.jsonl"), *more)
    told = capsys.readouterr()
    assert (code, told.out, lab.exists()) == (65, "", False)
    assert sentence in told.err
    assert told.err.count("\n") == 1


def test_positions_need_no_calibration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = np.random.default_rng(0).random((1, 33, 3)).repeat(60, axis=0)
    np.savez(tmp_path / "points.npz", positions=points, rate_hz=30.0, skeleton="mediapipe")
    assert calibrate(tmp_path / "points.npz", start="0")[0] == 65
    assert "expected a sensor's own rotations" in capsys.readouterr().err
