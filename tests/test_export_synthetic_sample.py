"""The sample recording: readable, small, and what the module writes."""

from pathlib import Path

import numpy as np

import fervor
from fervor import rotations
from fervor.recordings.bvh import read_bvh
from fervor.recordings.recording import rig_poses
from fervor_export.synthetic.sample import RATE_HZ, SECONDS, joy, main, motion

PACKAGED = Path(fervor.__file__).parent / "samples" / "joy.bvh"


def test_the_packaged_sample_is_what_the_module_writes() -> None:
    times, poses, observed = rig_poses(read_bvh(PACKAGED))
    meant_times, meant = motion()
    assert np.allclose(times, meant_times, atol=1e-4)
    assert observed.all()
    assert np.degrees(rotations.angle_between(poses, meant)).max() < 0.03, "write it again: python -m …synthetic.sample"


def test_the_sample_is_small_and_long_enough(tmp_path: Path) -> None:
    main([str(tmp_path / "new" / "joy.bvh")])
    assert (tmp_path / "new" / "joy.bvh").stat().st_size < 600_000
    recording = read_bvh(tmp_path / "new" / "joy.bvh")
    assert len(recording) == SECONDS * RATE_HZ
    assert all(recording.skeleton.sees)


def test_joy_is_weak_then_strong_then_weak_and_the_body_follows() -> None:
    times, poses = motion()
    level = joy(times)
    assert level[0] < 0.1 > level[-1]
    assert level.max() > 0.95
    speed = np.degrees(rotations.angle_between(poses[1:, :9], poses[:-1, :9])).mean(axis=1) * RATE_HZ
    assert speed[level[1:] > 0.8].mean() > 1.3 * speed[level[1:] < 0.2].mean()
