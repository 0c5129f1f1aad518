"""Motion files as clips need them: the T-pose, the phases, stretches, fingerprints, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

import datasets
from fervor.errors import DataError, RecordingError
from fervor.rotations import angle_between, slerp
from fervor.skeletons.rig import mirror_pose
from fervor_export.data.motion import fingerprints, read_motion


@pytest.mark.parametrize("t_poses", [0, 1, 3])
def test_the_t_pose_is_dropped_where_there_is_one(tmp_path: Path, t_poses: int) -> None:
    rotations = datasets.motion(seconds=1.0)
    motion = read_motion(datasets.write_bvh(tmp_path / "a.bvh", rotations, t_poses=t_poses))
    assert (motion.t_poses, motion.poses, motion.doubt) == (t_poses, len(rotations), "")
    assert angle_between(motion.phases[0].rotations[0].astype(float), rotations[0]).max() < 1e-5


def test_somebody_who_stands_with_arms_out_keeps_their_frames(tmp_path: Path) -> None:
    rotations = datasets.motion(seconds=1.0)
    way = np.linspace(0.0, 1.0, 60)[:, None]
    lowered = np.concatenate([slerp(datasets.t_pose(), rotations[0], np.broadcast_to(way, (60, 13))), rotations])
    motion = read_motion(datasets.write_bvh(tmp_path / "a.bvh", lowered, t_poses=0))
    assert motion.t_poses == 0
    assert motion.poses == len(lowered)
    assert "T-pose" in motion.doubt


@pytest.mark.parametrize(("rate", "count"), [(30, 1), (60, 2), (100, 3), (120, 4), (240, 4)])
def test_a_recording_has_the_phases_of_its_rate(tmp_path: Path, rate: int, count: int) -> None:
    rotations = datasets.motion(seconds=1.0, rate_hz=rate)
    motion = read_motion(datasets.write_npz(tmp_path / "a.npz", rotations, rate_hz=rate))
    assert len(motion.phases) == count
    if rate % 30 == 0 and rate // 30 == count:
        for index, phase in enumerate(motion.phases):
            expected = rotations[index::count]
            assert angle_between(phase.rotations.astype(float), expected[: len(phase.rotations)]).max() < 1e-5


def test_all_kinds_of_files_show_the_same_motion(tmp_path: Path) -> None:
    rotations = datasets.motion(seconds=1.0)
    files = [
        datasets.write_bvh(tmp_path / "a.bvh", rotations),
        datasets.write_mvnx(tmp_path / "a.mvnx", rotations),
        datasets.write_npz(tmp_path / "a.npz", rotations, rate_hz=120.0),
    ]
    for file in files:
        first = read_motion(file).phases[0]
        assert first.mask.all()
        assert angle_between(first.rotations.astype(float), rotations[::4]).max() < 2e-3, (
            file
        )  # BVH rounds its frame time


def test_points_become_rotations(tmp_path: Path) -> None:
    rotations = datasets.motion(seconds=1.0, rate_hz=30.0)
    motion = read_motion(datasets.write_positions(tmp_path / "a.csv", rotations), skeleton="mediapipe")
    assert len(motion.phases) == 1
    assert motion.phases[0].mask[:, 4].all()


def test_a_stretch_is_in_the_time_of_the_file(tmp_path: Path) -> None:
    rotations = datasets.motion(seconds=2.0, rate_hz=60.0)
    file = datasets.write_npz(tmp_path / "a.npz", rotations)
    motion = read_motion(file, start_s=0.5, end_s=1.5)
    assert motion.seconds == pytest.approx(1.0)
    assert angle_between(motion.phases[0].rotations.astype(float), rotations[30:91:2]).max() < 1e-5
    with pytest.raises(DataError, match="a start at 3 s"):
        read_motion(file, start_s=3.0)
    with pytest.raises(DataError, match="an end at 9 s"):
        read_motion(file, end_s=9.0)


def test_what_nobody_could_judge_is_refused(tmp_path: Path) -> None:
    rotations = datasets.motion(seconds=1.0)
    with pytest.raises(DataError, match="too short"):
        read_motion(datasets.write_bvh(tmp_path / "a.bvh", rotations[:30]))
    unseen = np.full_like(rotations, np.nan)
    with pytest.raises(DataError, match="upper body"):
        read_motion(datasets.write_npz(tmp_path / "a.npz", unseen))
    (tmp_path / "b.bvh").write_text("HIERARCHY\nnonsense")
    with pytest.raises(RecordingError, match="line 2"):
        read_motion(tmp_path / "b.bvh")


def test_odd_motion_is_told(tmp_path: Path) -> None:
    still = np.repeat(datasets.motion(seconds=0.1)[:1], 90, axis=0)
    assert "nothing moves" in read_motion(datasets.write_npz(tmp_path / "a.npz", still)).doubt
    slow = datasets.motion(seconds=2.0, rate_hz=10.0)
    assert "10.0 frames a second" in read_motion(datasets.write_npz(tmp_path / "b.npz", slow, rate_hz=10.0)).doubt


def test_fingerprints_are_those_of_a_pose_and_of_its_mirror_image() -> None:
    local, observed = datasets.motion(seconds=1.0), np.ones((120, 13), np.bool_)
    prints = fingerprints(local, observed)
    assert len(np.unique(prints)) > 60
    np.testing.assert_array_equal(fingerprints(-local, observed), prints)
    reflected = fingerprints(*mirror_pose(local, observed))
    assert not np.isin(reflected, prints).any()
    np.testing.assert_array_equal(fingerprints(*mirror_pose(*mirror_pose(local, observed))), prints)


def test_a_frame_time_in_milliseconds_is_refused(tmp_path: Path) -> None:
    file = datasets.write_bvh(tmp_path / "a.bvh", datasets.motion(seconds=1.0))
    file.write_text(file.read_text().replace("Frame Time: 0.008333", "Frame Time: 8.333"))
    with pytest.raises(DataError, match=r"it has 0\.12 frames a second; expected 5 or more"):
        read_motion(file)
