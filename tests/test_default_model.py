"""The model file that ships: small, a demo that says so, and alive on generated and on real motion."""

from pathlib import Path

import numpy as np
import pytest

from fervor.emotions import EMOTIONS, emotion_index
from fervor.model import Model, check_row_independence, default_model_path
from fervor.recordings.bvh import read_bvh
from fervor.recordings.recording import rig_poses
from fervor.rotations import slerp
from fervor_export.parity import check_parity
from fervor_export.synthetic import synthesise_motion
from fervor_export.weights import network_from_model_file

PLAIN = ("amusement", "anger", "disgust", "fear", "joy", "pride", "sadness", "shame")
"""Emotions whose display in generated motion is hard to miss; relief and surprise are short events."""


@pytest.fixture(scope="module")
def model() -> Model:
    return Model.load(default_model_path())


def estimates(model: Model, rotations: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """Intensities by emotion after the first second: [frame, 11]."""
    frames = len(rotations)
    observed = np.ones((1, frames, 13), np.float32) if mask is None else mask[None].astype(np.float32)
    unknown = np.zeros((1, frames, len(EMOTIONS)), np.float32)
    outputs = model.run(rotations[None].astype(np.float32), observed, unknown, model.zero_states(1))
    return outputs.intensity_by_emotion[0, 30:]


def generated(emotion: str, intensity: float, seed: int, seconds: float = 6.0) -> np.ndarray:
    return synthesise_motion(emotion=emotion, intensity=intensity, seconds=seconds, seed=seed, rate_hz=30.0)[1]


def test_it_is_a_small_demo_that_says_so(model):
    assert (model.metadata.name, model.metadata.purpose) == ("fervor-demo", "demo")
    assert default_model_path().stat().st_size < 2_000_000
    card = default_model_path().with_name("MODEL_CARD.md").read_text(encoding="utf-8")
    assert f"fervor-demo {model.metadata.version} (demo)" in card
    assert "not science" in card
    assert model.metadata.training.sha256[:16] in card
    assert f"{model.metadata.scores['test_mae']:.3f}" in card


def test_its_rows_are_independent_and_its_weights_can_be_read_back(model):
    assert check_row_independence(model) == 1
    assert check_parity(network_from_model_file(default_model_path()), model).agrees


def test_its_thresholds_lie_where_its_estimates_do(model):
    for emotion, threshold in model.metadata.levels.threshold.items():
        assert 0.05 < threshold < 0.95, emotion


@pytest.mark.parametrize("emotion", PLAIN)
def test_stronger_displays_are_estimated_higher(model, emotion):
    weak, strong = (
        np.mean([estimates(model, generated(emotion, intensity, seed)).mean(0) for seed in range(900, 906)], axis=0)
        for intensity in (0.0, 1.0)
    )
    index = emotion_index(emotion)
    assert strong[index] > weak[index] + 0.2
    assert strong[index] > np.median(strong)


def test_neutral_is_what_shows_nothing(model):
    index = emotion_index("neutral")
    calm = estimates(model, generated("neutral", 0.0, 900)).mean(0)
    assert calm.argmax() == index
    assert estimates(model, generated("anger", 1.0, 900)).mean(0)[index] < calm[index] - 0.2


def test_minutes_on_one_state_neither_saturate_nor_stick(model):
    rng = np.random.default_rng(0)
    scenes = [generated(str(rng.choice(PLAIN)), float(rng.random()), seed, 12.0) for seed in range(910, 920)]
    late = estimates(model, np.concatenate(scenes))[-1800:]  # the second minute
    assert np.isfinite(late).all()
    assert late.std(0).max() > 0.05
    assert 0.1 < np.median(late) < 0.9


REAL = (
    "100style/angry_reference",
    "100style/elated_reference",
    "100style/rushed_reference",
    "cmu/79_69",
    "cmu/79_70",
    "cmu/79_71",
)


@pytest.mark.parametrize("name", REAL)
def test_real_motion_gives_estimates_that_move(model, shared_data: Path, name):
    times, rotations, observed = rig_poses(read_bvh(shared_data / f"{name}.bvh"))
    grid = np.arange(times[0], times[-1], 1 / 30)
    before = np.clip(np.searchsorted(times, grid, side="right") - 1, 0, len(times) - 2)
    fraction = (grid - times[before]) / (times[before + 1] - times[before])
    frames = slerp(rotations[before], rotations[before + 1], np.repeat(fraction[:, None], 13, 1))
    found = estimates(model, frames, observed[before] & observed[before + 1])
    assert found.std(0).max() > 0.03  # over time
    assert found.std(1).mean() > 0.1  # across emotions
    assert ((found > 0.05) & (found < 0.95)).mean() > 0.5
