"""Features computed once are those computed anew in every epoch, to the bit; so is what is learned from them."""

from dataclasses import replace

import pytest
import torch

from fervor_export.batches import training_batches
from fervor_export.network import Network, NetworkConfig
from fervor_export.prepared import PreparedClips
from fervor_export.recipe import DEFAULT, PAPER, Recipe
from fervor_export.training import split_by_actor, train
from networks import waving_clips

CHANCES = ("crop", "join", "joint_dropout", "leg_dropout", "wrist_dropout", "trunk_dropout", "bind_noise_deg")
STEADY = (
    replace(PAPER, epochs=2, batch_size=16, longest_s=2.0),
    replace(DEFAULT, epochs=2, batch_size=16, **dict.fromkeys(CHANCES, 0.0)),
)


@pytest.mark.parametrize("recipe", STEADY, ids=lambda recipe: recipe.name)
def test_batches_are_the_plain_ones(recipe):
    clips = [replace(clip, mask=clip.mask & (index % 13 != 3)) for index, clip in enumerate(waving_clips(50))]
    network = Network(NetworkConfig(features=recipe.features))
    prepared = list(PreparedClips(clips, recipe, network).batches(seed=4, epoch=2))
    plain = list(training_batches(clips, recipe, seed=4, epoch=2))
    assert len(prepared) == len(plain) == 4
    for fast, slow in zip(prepared, plain, strict=True):
        seen, _ = network.features(slow.rotations, slow.mask, network.zero_states(len(slow.target)))
        assert torch.equal(fast.features, seen)
        for name in ("emotion", "target", "weight"):
            assert torch.equal(getattr(fast, name), getattr(slow, name))
        for mine, theirs in zip(fast.groups(), slow.groups(), strict=True):
            assert mine.features.shape[:2] == theirs.mask.shape[:2]
            assert mine.lengths.tolist() == theirs.lengths.tolist()


@pytest.mark.parametrize("recipe", STEADY, ids=lambda recipe: recipe.name)
def test_what_is_learned_is_the_same(recipe, monkeypatch):
    sides = split_by_actor(waving_clips(40), seed=1)
    fast = train(*sides, recipe, seed=3)
    monkeypatch.setattr(Recipe, "steady", property(lambda _: False))
    slow = train(*sides, recipe, seed=3)
    assert fast.history[-1].loss == slow.history[-1].loss
    for name, weight in fast.network.state_dict().items():
        assert torch.equal(weight, slow.network.state_dict()[name]), name
