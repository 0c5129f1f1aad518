"""Folds: every clip judged once, nothing on both sides, and a planted leak is caught."""

from dataclasses import replace

import numpy as np
import pytest

from fervor.errors import DataError
from fervor.skeletons.rig import mirror_pose
from fervor_export.clip import Clip, Phase
from fervor_export.data.augment import augment
from fervor_export.evaluation import protocols
from fervor_export.evaluation.protocols import Learner
from fervor_export.evaluation.splits import Split, as_given, assert_disjoint, by_actor, by_recording
from fervor_export.recipe import DEFAULT
from networks import waving_clips


def sides(clips: list[Clip], split: Split):
    for fold in split:
        yield [clips[index] for index in fold.train], [clips[index] for index in fold.test]


def with_phases(clips: list[Clip]) -> list[Clip]:
    return [replace(clip, phases=(Phase(clip.rotations[1:], clip.mask[1:]),) * 3) for clip in clips]


@pytest.mark.parametrize("split", [by_recording, by_actor])
def test_every_clip_is_judged_once_and_is_never_learned_from_then(split):
    clips = waving_clips(60)
    folds = split(clips, seed=3)
    assert sorted(index for fold in folds for index in fold.test) == list(range(60))
    for fold in folds:
        assert not set(fold.train) & set(fold.test)
        assert len(fold.train) + len(fold.test) == 60


@pytest.mark.parametrize(("split", "unit"), [(by_recording, "recording"), (by_actor, "actor")])
def test_no_recording_or_actor_stands_on_both_sides_copies_included(split, unit):
    clips = with_phases(waving_clips(60))
    clips = [clips[index] for index in np.random.default_rng(0).permutation(60)]  # no order helps to keep actors apart
    for train, test in sides(clips, split(clips)):
        copies = augment(train)
        assert len(copies) == 8 * len(train)
        assert_disjoint(copies, test, unit=unit)
        assert_disjoint(copies, augment(test), unit=unit)


def test_cuts_of_one_recording_stay_together():
    clips = waving_clips(60)
    cuts = [replace(clip, name=f"take {index // 4}") for index, clip in enumerate(clips)]
    for train, test in sides(cuts, by_recording(cuts)):
        assert not {clip.name for clip in train} & {clip.name for clip in test}


def test_a_planted_leak_is_caught():
    clips = waving_clips(20)
    leaked = replace(clips[0], rotations=mirror_pose(clips[0].rotations, clips[0].mask)[0])
    with pytest.raises(DataError, match="a leak: 1 recordings are both trained on and judged by"):
        assert_disjoint([*clips[10:], leaked], clips[:10])
    with pytest.raises(DataError, match="a leak: 4 actors"):
        assert_disjoint(clips[10:], clips[:4], unit="actor")
    assert_disjoint(clips[10:], clips[:10])


def test_a_leak_by_augmentation_is_caught_before_training(monkeypatch):
    clips = waving_clips(24)
    monkeypatch.setattr(protocols, "train", lambda *_, **__: pytest.fail("trained on a leak"))
    learner = Learner(DEFAULT, augment=lambda learn: [*learn, clips[0]])
    with pytest.raises(DataError, match=r"a leak: .*clip0"):
        learner.learn(clips[6:], clips[:6], "recording", None)


def test_recordings_that_repeat_each_other_stay_together():
    clips = waving_clips(60)
    same = {"clip7": "clip7", "clip8": "clip7", "clip31": "clip7"}
    where = {
        clips[index].name: number for number, fold in enumerate(by_recording(clips, same=same)) for index in fold.test
    }
    assert where["clip7"] == where["clip8"] == where["clip31"]
    for train, test in sides(clips, by_actor(clips, same=same)):
        both = [{clip.name for clip in side} & {"clip7", "clip8", "clip31"} for side in (train, test)]
        assert not both[0] or not both[1]


def test_folds_have_their_share_of_every_emotion():
    clips = waving_clips(110)
    for _, test in sides(clips, by_recording(clips)):
        assert {
            emotion: sum(clip.emotion == emotion for clip in test) for emotion in {clip.emotion for clip in test}
        } == (dict.fromkeys({clip.emotion for clip in clips}, 2))


def test_one_actor_is_left_out_at_a_time_or_several_of_many():
    few = waving_clips(60, actors=6)
    assert [len({clip.actor for clip in test}) for _, test in sides(few, by_actor(few))] == [1] * 6
    many = waving_clips(120, actors=40)
    left = [{clip.actor for clip in test} for _, test in sides(many, by_actor(many))]
    assert len(left) == 10
    assert sum(map(len, left)) == len(set.union(*left)) == 40


def test_the_seed_decides():
    clips = waving_clips(50)
    assert by_recording(clips, seed=1) == by_recording(clips, seed=1) != by_recording(clips, seed=2)
    many = waving_clips(50, actors=25)
    assert by_actor(many, seed=1) == by_actor(many, seed=1) != by_actor(many, seed=2)


def test_what_can_not_be_split():
    with pytest.raises(DataError, match="3 recordings can't be split into 5 folds"):
        by_recording(waving_clips(3))
    with pytest.raises(DataError, match="4 clips of 1 actor can't be split"):
        by_actor(waving_clips(4, actors=1))
    clips = waving_clips(10)
    with pytest.raises(DataError, match="a leak"):
        as_given(clips, clips[:6], clips[5:])


def test_a_given_split_does_not_learn_from_what_repeats_a_judged_recording():
    clips = waving_clips(10)
    same = {"clip1": "clip1", "clip7": "clip1"}
    (fold,) = as_given(clips, clips[:5], clips[5:], same=same)
    assert (fold.train, fold.test) == ((0, 2, 3, 4), (5, 6, 7, 8, 9))


def test_the_split_that_the_data_bring():
    clips = waving_clips(10)
    (fold,) = as_given(clips, clips[:3], clips[5:])
    assert (fold.train, fold.test) == ((0, 1, 2), (5, 6, 7, 8, 9))
