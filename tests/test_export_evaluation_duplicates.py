"""Recordings under two names are found, whatever was done to them, and different ones are not taken for the same."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.rig import mirror_pose
from fervor_export.clip import Clip, Phase
from fervor_export.evaluation.disturbances import at_rate, regrid
from fervor_export.evaluation.duplicates import groups
from fervor_export.evaluation.estimator import Motion
from fervor_export.synthetic import synthesise_dataset


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    return synthesise_dataset(clips=80, seed=5)


def again(clip: Clip, motion: Motion) -> Clip:
    return replace(clip, rotations=motion.rotations, mask=motion.mask, name="another name", actor="somebody else")


def turned(clip: Clip, degrees: np.ndarray) -> Motion:
    """Every joint turned by rotation vectors [frame or 1, 13, 3]."""
    turns = np.broadcast_to(np.radians(degrees), (clip.frames, 13, 3)).reshape(-1, 3).copy()
    rotations = Rotation.from_quat(clip.rotations.reshape(-1, 4)) * Rotation.from_rotvec(turns)
    return Motion(rotations.as_quat().reshape(clip.rotations.shape).astype(np.float32), clip.mask)


def noisy(clip: Clip) -> Motion:
    return turned(clip, np.random.default_rng(1).normal(0, 0.7, (clip.frames, 13, 3)))


def mounted_otherwise(clip: Clip) -> Motion:
    return turned(clip, np.random.default_rng(2).normal(0, 2.0, (1, 13, 3)))


def smoothed(clip: Clip) -> Motion:
    return at_rate(regrid(Motion.of(clip), np.arange(clip.frames) / 30), 15.0)


def faster(clip: Clip) -> Motion:
    return regrid(Motion.of(clip), np.arange(clip.frames) / 31.5)


WAYS: dict[str, Callable[[Clip], Motion]] = {
    "the same": Motion.of,
    "mirrored": lambda clip: Motion(*mirror_pose(clip.rotations, clip.mask)),
    "another phase": lambda clip: at_rate(Motion.of(clip), 120.0),
    "cut": lambda clip: Motion(clip.rotations[clip.frames // 3 :], clip.mask[clip.frames // 3 :]),
    "noisy": noisy,
    "mounted otherwise": mounted_otherwise,
    "every other frame lost": smoothed,
    "5 % faster": faster,
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_recording_under_another_name_is_found(clips, way):
    for original in clips[3:60:16]:
        found = groups([*clips, again(original, way(original))])
        assert found == dict.fromkeys(sorted((original.name, "another name")), min(original.name, "another name"))


def test_phases_average_out_noise(clips):
    random = np.random.default_rng(3)

    def frames(clip: Clip) -> Motion:
        return turned(clip, random.normal(0, 2.0, (clip.frames, 13, 3)))

    for original in clips[3:60:16]:
        first, *others = (frames(original) for _ in range(4))
        copy = replace(again(original, first), phases=tuple(Phase(one.rotations, one.mask) for one in others))
        assert "another name" in groups([*clips, copy])


def test_different_recordings_are_different(clips):
    assert groups(clips) == {}
    assert groups([]) == {}
    assert groups(clips[:1]) == {}


def test_standing_still_is_no_evidence(clips):
    still = [
        replace(clip, rotations=clips[0].rotations[:1].repeat(60, 0), mask=clips[0].mask[:1].repeat(60, 0))
        for clip in clips[:5]
    ]
    assert groups(still) == {}
