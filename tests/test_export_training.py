"""Training: it learns, repeats itself by seed, and never peeks at validation actors."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from fervor.errors import DataError
from fervor_export.batches import pad, plain_stream
from fervor_export.clip import Phase
from fervor_export.objective import loss
from fervor_export.prediction import fit, predict
from fervor_export.recipe import DEFAULT, PAPER, RECIPES
from fervor_export.scores import concordance
from fervor_export.training import copies, sides, split_by_actor, train
from networks import waving_clips

QUICK = replace(DEFAULT, epochs=6, batch_size=16, learning_rate=5e-3, join=0.1, bind_noise_deg=1.0)


@pytest.fixture(scope="module")
def split():
    return split_by_actor(waving_clips(90), seed=1)


@pytest.fixture(scope="module")
def result(split):
    return train(*split, QUICK, seed=3)


def test_a_split_keeps_actors_apart():
    clips = waving_clips(60, actors=10)
    learn, validate = split_by_actor(clips, seed=0)
    assert not {clip.actor for clip in learn} & {clip.actor for clip in validate}
    assert len({clip.actor for clip in validate}) == 2
    assert len(learn) + len(validate) == len(clips)
    assert [clip.name for clip in split_by_actor(clips, seed=0)[1]] == [clip.name for clip in validate]
    with pytest.raises(DataError, match="1 actor"):
        split_by_actor(waving_clips(5, actors=1))


def test_it_learns(split, result):
    assert result.history[-1].loss < 0.7 * result.history[0].loss
    assert result.kept.validation.r > 0.7
    assert result.stopped == "epochs"
    assert result.kept.validation.mae == min(epoch.validation.mae for epoch in result.history)


def test_the_best_weights_are_kept(split, result):
    scores = fit(split[1], predict(result.network, split[1], QUICK))
    assert scores.as_dict() == pytest.approx(result.kept.validation.as_dict(), abs=2e-4)


def test_the_paper_learns_too_from_all_clips(split):
    recipe = replace(PAPER, epochs=4, batch_size=16)
    learn, validate = sides([*split[0], *split[1]], recipe)
    assert (len(learn), validate) == (90, [])
    result = train(learn, validate, recipe)
    assert result.history[-1].train_mae < result.history[0].train_mae
    assert result.network.config.features == "euler"
    assert (result.kept, result.stopped) == (result.history[-1], "epochs")
    assert {epoch.validation for epoch in result.history} == {None}


def test_the_paper_is_followed_to_the_letter():
    assert (PAPER.features, PAPER.head, PAPER.optimizer, PAPER.loss_at) == ("euler", "additive", "rmsprop", "last")
    assert (PAPER.epochs, PAPER.batch_size, PAPER.mirror, PAPER.phases, PAPER.keep) == (100, 256, True, 4, "last")
    assert (PAPER.ccc_weight, PAPER.unknown_share, PAPER.standardise, PAPER.patience) == (0.0, 0.0, False, None)
    assert PAPER.steady
    assert not DEFAULT.steady


def test_copies_are_the_recipes(split):
    clip = replace(split[0][0], phases=tuple([Phase(split[0][0].rotations, split[0][0].mask)] * 3))
    assert len(copies([clip], PAPER)) == 8
    assert copies([clip], DEFAULT) == [clip]
    assert len(copies([clip], replace(DEFAULT, mirror=True))) == 2
    assert {recipe.mirror for recipe in RECIPES.values()} == {True, False}


def test_the_last_epoch_may_be_worse_than_the_best(split):
    recipe = replace(QUICK, epochs=4, learning_rate=0.05, keep="last")
    result = train(*split, recipe, seed=3)
    assert result.kept.number == 4
    scores = fit(split[1], predict(result.network, split[1], recipe))
    assert scores.as_dict() == pytest.approx(result.history[-1].validation.as_dict(), abs=5e-4)


def test_the_seed_decides(split):
    recipe = replace(QUICK, epochs=1)
    before = torch.get_rng_state()
    here, again, other = (train(*split, recipe, seed=seed) for seed in (5, 5, 6))
    assert torch.equal(torch.get_rng_state(), before)
    for name, weight in here.network.state_dict().items():
        assert torch.equal(weight, again.network.state_dict()[name])
    assert not torch.equal(here.network.lstm1.weight_hh_l0, other.network.lstm1.weight_hh_l0)
    assert replace(here.history[0], seconds=0.0) == replace(again.history[0], seconds=0.0)


def test_patience_and_time_end_training(split):
    patient = train(*split, replace(QUICK, epochs=50, learning_rate=0.0, weight_decay=0.0, patience=1))
    assert (patient.stopped, len(patient.history)) == ("patience", 2)
    hurried = train(*split, QUICK, max_minutes=0.0)
    assert (hurried.stopped, len(hurried.history)) == ("time", 1)


def test_progress_is_told(split):
    epochs, counts = [], []
    train(*split, replace(QUICK, epochs=2), on_epoch=epochs.append, on_batch=counts.append)
    assert [epoch.number for epoch in epochs] == [1, 2]
    assert sum(counts) == 2 * len(split[0])


def test_what_can_not_be_trained_on(split):
    learn, validate = split
    with pytest.raises(DataError, match="clips on both sides; there are 0"):
        train([], validate, QUICK)
    with pytest.raises(DataError, match=r"clips on both sides; there are \d+ and 0"):
        train(learn, [], QUICK)
    with pytest.raises(DataError, match=r"actors .* are among the training and"):
        train(learn, learn[:3], QUICK)


def test_loss_by_its_definition():
    clips = [replace(clip, observers=None) for clip in waving_clips(6)]
    batch = pad([plain_stream(clip, PAPER) for clip in clips])
    predicted = torch.rand(batch.target.shape, generator=torch.Generator().manual_seed(0))
    last = np.asarray([float(predicted[row, clip.frames - 1]) for row, clip in enumerate(clips)])
    target = np.asarray([clip.intensity for clip in clips])
    error = np.abs(last - target).mean()
    assert float(loss(predicted, batch.target, batch.weight, 0.0)) == pytest.approx(error, rel=1e-5)
    expected = 0.7 * error + 0.3 * (1 - concordance(last, target))
    assert float(loss(predicted, batch.target, batch.weight, 0.3)) == pytest.approx(expected, rel=1e-4)


def test_padding_changes_no_gradient(split, result):
    network = result.network
    stream = plain_stream(split[0][0], QUICK)
    longer = plain_stream(max(split[0], key=lambda clip: clip.frames), QUICK)
    assert len(longer) > len(stream)
    alone, beside = pad([stream]), pad([stream, longer])
    with torch.no_grad():
        here, _ = network.logits(alone.rotations, alone.mask)
        there, _ = network.logits(beside.rotations, beside.mask)
    torch.testing.assert_close(here[0], there[0, : len(stream)], atol=1e-5, rtol=1e-5)
