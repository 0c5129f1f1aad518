"""Clips to batches."""

from dataclasses import replace

import numpy as np
import pytest

from fervor_export.batches import (
    LEGS,
    OBSERVERS,
    arrange,
    batches_an_epoch,
    cut,
    pad,
    plain_stream,
    training_batches,
)
from fervor_export.recipe import DEFAULT, PAPER, RECIPES, Recipe
from networks import waving_clips

NOTHING = ("crop", "join", "joint_dropout", "leg_dropout", "wrist_dropout", "trunk_dropout", "bind_noise_deg")
PLAIN = replace(DEFAULT, batch_size=8, **dict.fromkeys(NOTHING, 0.0))


@pytest.fixture(scope="module")
def clips():
    return waving_clips(30)


def epoch(clips, recipe: Recipe, seed: int = 0, number: int = 1):
    return list(training_batches(clips, recipe, seed=seed, epoch=number))


def test_weights_say_where_something_is_expected(clips):
    clip = replace(clips[1], observers=None)
    last, frames = plain_stream(clip, PAPER).weight, plain_stream(clip, DEFAULT).weight
    assert last[-1] == 1
    assert not last[:-1].any()
    assert not frames[:30].any()
    assert frames[30:].all()
    assert frames.sum() == pytest.approx(1)
    assert plain_stream(replace(clip, observers=int(OBSERVERS)), DEFAULT).weight.sum() == pytest.approx(0.5)


def test_short_clips_are_asked_at_their_end(clips):
    short = replace(clips[1], rotations=clips[1].rotations[:12], mask=clips[1].mask[:12], observers=None)
    weight = plain_stream(short, DEFAULT).weight
    assert weight.nonzero()[0].tolist() == [11]


def test_padding_weighs_nothing(clips):
    batch = pad([plain_stream(clip, DEFAULT) for clip in clips[:5]])
    for row, clip in enumerate(clips[:5]):
        np.testing.assert_array_equal(batch.rotations[row, : clip.frames], clip.rotations)
        assert not batch.weight[row, clip.frames :].any()
        assert not batch.mask[row, clip.frames :].any()


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=lambda recipe: recipe.name)
def test_every_clip_has_its_turn(clips, recipe):
    batches = epoch(clips, replace(recipe, batch_size=8))
    assert sum(len(batch.target) for batch in batches) == len(clips)
    seen = {round(float(value), 5) for batch in batches for value in batch.target.unique()}
    assert {round(clip.intensity, 5) for clip in clips} <= seen


def test_batches_are_of_similar_length(clips):
    many = waving_clips(200)
    padded = sum(batch.target.numel() for batch in epoch(many, PLAIN))
    assert padded < 1.15 * sum(clip.frames for clip in many)


@pytest.mark.parametrize(("count", "size"), [(300, 256), (12_000, 256), (513, 64), (7, 64), (2049, 256)])
def test_no_length_counts_for_more_than_another(count, size):
    """The mean over an epoch's batches of the mean in each is nearly the mean over clips, whatever their length."""
    lengths = np.sort(np.random.default_rng(0).integers(40, 400, count)).tolist()
    batches = arrange(lengths, size, seed=0, epoch=3)
    assert sorted(np.concatenate(batches).tolist()) == list(range(count))
    assert len(batches) == batches_an_epoch(count, size)
    sizes = [len(batch) for batch in batches]
    assert max(sizes) <= size
    assert max(sizes) - min(sizes) <= 1
    share = np.zeros(count)
    for batch in batches:
        share[batch] = 1 / (len(batch) * len(batches))
    assert np.average(lengths, weights=share) == pytest.approx(np.mean(lengths), rel=0.01)


def test_company_changes_from_epoch_to_epoch(clips):
    first, second = (arrange([60] * 50, 10, seed=0, epoch=number) for number in (1, 2))
    assert {tuple(batch) for batch in first} != {tuple(batch) for batch in second}


def test_what_is_left_of_a_clip_that_is_too_long(clips):
    short = replace(DEFAULT, longest_s=1.0)
    np.testing.assert_array_equal(cut(clips[0], short).rotations, clips[0].rotations[:30])
    last = cut(clips[0], replace(PAPER, longest_s=1.0))
    np.testing.assert_array_equal(last.rotations, clips[0].rotations[-30:])
    assert plain_stream(last, PAPER).weight[-1] > 0
    assert cut(clips[0], PAPER) is clips[0]


def test_the_seed_decides(clips):
    recipe = replace(DEFAULT, batch_size=8)
    here, again, other = epoch(clips, recipe, 1), epoch(clips, recipe, 1), epoch(clips, recipe, 1, 2)
    assert all(
        np.array_equal(a.rotations, b.rotations) and np.array_equal(a.mask, b.mask)
        for a, b in zip(here, again, strict=True)
    )
    assert any(a.rotations.shape != b.rotations.shape for a, b in zip(here, other, strict=True))


def test_joined_clips_expect_nothing_in_between(clips):
    recipe = replace(PLAIN, join=0.9, longest_s=6.0)
    for batch in epoch(clips, recipe):
        norms = batch.rotations.norm(dim=-1)
        observed = batch.mask.bool()
        np.testing.assert_allclose(norms[observed], 1, atol=1e-5)
        assert batch.rotations.shape[1] <= 180
        turns = (batch.rotations[:, 1:] * batch.rotations[:, :-1]).sum(-1).abs()[observed[:, 1:] & observed[:, :-1]]
        assert turns.min() > 0.9  # no jump from one clip to the next
        for row in range(len(batch.target)):
            changes = batch.target[row].diff().nonzero()
            for change in changes:
                assert not batch.weight[row, change + 1 : change + 31].any()


def test_lost_joints_are_masked_for_the_whole_stream(clips):
    for batch in epoch(clips, replace(PLAIN, leg_dropout=1.0)):
        assert not batch.mask[..., list(LEGS)].any()
        assert batch.mask[:, 0, 0].all()


def test_crops_keep_two_seconds():
    clips = waving_clips(20)
    lengths = {clip.frames for clip in clips}
    batches = epoch(clips, replace(PLAIN, crop=1.0, batch_size=1))
    cropped = [batch.target.shape[1] for batch in batches]
    assert min(cropped) >= min(*lengths, 60)
    assert set(cropped) != lengths


def test_bind_noise_is_constant_and_small(clips):
    stream = plain_stream(clips[0], PLAIN)
    (batch,) = epoch(clips[:1], replace(PLAIN, bind_noise_deg=5.0))
    relative = np.abs((batch.rotations[0].numpy() * stream.rotations).sum(-1)).clip(0, 1)
    angles = 2 * np.arccos(relative)
    assert 0 < angles.max() < np.deg2rad(40)
    np.testing.assert_allclose(angles, angles[:1].repeat(len(angles), 0), atol=5e-3)
