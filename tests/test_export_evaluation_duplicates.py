"""Recordings under two names are found, and different ones are not taken for the same."""

from dataclasses import replace

import pytest

from fervor.skeletons.rig import mirror_pose
from fervor_export.clip import Clip
from fervor_export.evaluation.disturbances import at_rate
from fervor_export.evaluation.duplicates import groups
from fervor_export.evaluation.estimator import Motion
from fervor_export.synthetic import synthesise_dataset


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    return synthesise_dataset(clips=80, seed=5)


def again(clip: Clip, motion: Motion) -> Clip:
    return replace(clip, rotations=motion.rotations, mask=motion.mask, name="another name", actor="somebody else")


WAYS = {
    "the same": Motion.of,
    "mirrored": lambda clip: Motion(*mirror_pose(clip.rotations, clip.mask)),
    "another phase": lambda clip: at_rate(Motion.of(clip), 120.0),
    "cut": lambda clip: Motion(clip.rotations[clip.frames // 3 :], clip.mask[clip.frames // 3 :]),
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_recording_under_another_name_is_found(clips, way):
    for original in clips[3:60:8]:
        found = groups([*clips, again(original, way(original))])
        assert found == dict.fromkeys(sorted((original.name, "another name")), min(original.name, "another name"))


def test_different_recordings_are_different(clips):
    assert groups(clips) == {}
    assert groups([]) == {}


def test_standing_still_is_no_evidence(clips):
    still = [
        replace(clip, rotations=clips[0].rotations[:1].repeat(60, 0), mask=clips[0].mask[:1].repeat(60, 0))
        for clip in clips[:5]
    ]
    assert groups(still) == {}
