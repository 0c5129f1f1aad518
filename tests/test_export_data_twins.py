"""The same motion under two names is found, whatever was done to the file; different motion never is."""

from pathlib import Path

import numpy as np

import datasets
from fervor.skeletons.rig import mirror_pose
from fervor_export.data.motion import Motion, read_motion
from fervor_export.data.twins import Twins, find_twins


def mirrored(rotations: datasets.Array) -> datasets.Array:
    return mirror_pose(rotations, np.ones(rotations.shape[:2], np.bool_))[0]


def read(tmp_path: Path, *motions: datasets.Array) -> list[Motion]:
    return [
        read_motion(datasets.write_bvh(tmp_path / f"{index}.bvh", rotations)) for index, rotations in enumerate(motions)
    ]


def test_copies_mirror_images_and_cuts_are_found(tmp_path: Path) -> None:
    take, other = datasets.motion(seconds=2.0), datasets.motion(seconds=2.0, seed=1)
    motions = read(tmp_path, other, take, take, mirrored(take), take[100:], take[:140:2])
    found = find_twins(motions)
    assert {(twins.first, twins.second) for twins in found} >= {(1, 2), (1, 3), (1, 4), (1, 5), (2, 3)}
    assert all(twins.first > 0 for twins in found)
    assert Twins(1, 3, mirrored=True) in found
    assert Twins(1, 2, mirrored=False) in found


def test_a_copy_written_with_fewer_digits_is_found(tmp_path: Path) -> None:
    take = datasets.motion(seconds=2.0)
    bvh = read_motion(datasets.write_bvh(tmp_path / "a.bvh", take))
    npz = read_motion(datasets.write_npz(tmp_path / "a.npz", np.round(take, 5), rate_hz=120.0))
    assert len(find_twins([bvh, npz])) == 1


def test_different_motion_is_not(tmp_path: Path) -> None:
    motions = [datasets.motion("joy" if seed % 2 else "sadness", seconds=2.0, seed=seed) for seed in range(12)]
    assert not find_twins(read(tmp_path, *motions))


def test_a_pose_that_all_begin_with_makes_no_twins(tmp_path: Path) -> None:
    start = datasets.motion(seconds=0.1)[:1]
    motions = [
        np.concatenate([np.repeat(start, 60, axis=0), datasets.motion(seconds=1.0, seed=seed)]) for seed in (1, 2)
    ]
    assert not find_twins(read(tmp_path, *motions))
    assert not find_twins([])
