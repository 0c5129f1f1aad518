"""The paper's network in torch."""

import pytest
import torch

from fervor.emotions import EMOTIONS
from fervor_export.network import Head, NetworkConfig, mixture
from networks import CONFIGS, frames, network


@pytest.fixture(params=CONFIGS, ids=lambda config: f"{config.features} {config.head}")
def config(request):
    return request.param


def test_shapes_are_the_model_files(config):
    outputs = network(config)(*map(torch.from_numpy, frames(3, 5)))
    assert outputs.intensity.shape == (3, 5)
    assert outputs.intensity_by_emotion.shape == (3, 5, 11)
    assert {name: tuple(state.shape[1:]) for name, state in outputs.states.items()} == {
        state.name: state.shape for state in config.states
    }


def test_one_hot_labels_pick_their_emotion(config):
    rotations, mask, _ = map(torch.from_numpy, frames(11, 5))
    emotion = torch.eye(11)[:, None].expand(11, 5, 11)
    outputs = network(config)(rotations, mask, emotion)
    for index in range(11):
        torch.testing.assert_close(outputs.intensity[index], outputs.intensity_by_emotion[index, :, index])


def test_states_do_not_depend_on_the_emotion(config):
    rotations, mask, emotion = map(torch.from_numpy, frames(3, 5))
    here, there = (network(config)(rotations, mask, e) for e in (emotion, torch.zeros_like(emotion)))
    for name, state in here.states.items():
        assert torch.equal(state, there.states[name])
    assert torch.equal(here.intensity_by_emotion, there.intensity_by_emotion)


def test_steps_with_states_are_the_sequence(config):
    rotations, mask, emotion = map(torch.from_numpy, frames(3, 9))
    whole = network(config)(rotations, mask, emotion)
    first = network(config)(rotations[:, :4], mask[:, :4], emotion[:, :4])
    rest = network(config)(rotations[:, 4:], mask[:, 4:], emotion[:, 4:], first.states)
    torch.testing.assert_close(torch.cat([first.intensity, rest.intensity], 1), whole.intensity)


@pytest.mark.parametrize("kind", ["additive", "gated"])
def test_the_head_is_the_papers_layer(kind):
    torch.manual_seed(0)
    head = Head(kind, 8)
    torch.nn.init.normal_(head.emotion_bias)
    if kind == "gated":
        torch.nn.init.normal_(head.emotion_weight)
    descriptor, emotion = torch.randn(4, 8), torch.rand(4, 11) / 11
    logit = (mixture(emotion) * head(descriptor)).sum(-1)
    w, b = head.shared.weight[0], head.shared.bias[0]
    expected = descriptor @ w + b + emotion @ head.emotion_bias
    if kind == "gated":
        expected = expected + (emotion * (descriptor @ head.emotion_weight.T)).sum(-1)
    torch.testing.assert_close(logit, expected)


def test_an_additive_head_trains_no_gates():
    assert not Head("additive", 8).emotion_weight.requires_grad
    assert Head("gated", 8).emotion_weight.requires_grad


def test_columns_round_trip():
    head, copy = Head("gated", 8), Head("gated", 8)
    torch.nn.init.normal_(head.emotion_weight)
    copy.set_columns(*head.columns())
    for ours, theirs in zip(head.columns(), copy.columns(), strict=True):
        torch.testing.assert_close(ours, theirs)


def test_the_paper_has_no_previous_pose():
    assert [state.name for state in NetworkConfig(features="euler").states] == ["h1", "c1", "h2", "c2"]
    assert len(EMOTIONS) == 11


def test_folding_a_standardisation_changes_nothing(config):
    data = tuple(map(torch.from_numpy, frames(3, 9)))
    standardised = network(config)
    torch.manual_seed(0)
    features = len(standardised.mean)
    standardised.standardise(torch.randn(features), 0.5 + torch.rand(features))
    with torch.no_grad():
        before = standardised(*data)
        standardised.fold()
        after = standardised(*data)
    assert not standardised.mean.any()
    assert torch.equal(standardised.scale, torch.ones(features))
    torch.testing.assert_close(before.intensity, after.intensity, atol=1e-5, rtol=0)
    assert (before.intensity - network(config)(*data).intensity).abs().max() > 1e-3
