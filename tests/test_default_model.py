"""The model file that ships: small, a demo that says so, and alive on generated and on real motion."""

from pathlib import Path

import numpy as np
import pytest
from bench.counterfactual import Reading, Row, cuts_of, measure, read, read_out
from bench.edits import Cut, Edit, edited

from fervor.emotions import EMOTIONS, emotion_index
from fervor.model import Model, check_row_independence, default_model_path
from fervor_export.parity import check_parity
from fervor_export.synthetic import synthesise_motion
from fervor_export.weights import network_from_model_file

PLAIN = ("amusement", "anger", "disgust", "fear", "joy", "pride", "sadness", "shame")
"""Emotions whose display in generated motion is hard to miss; relief and surprise are short events."""

FELT = tuple(emotion for emotion in EMOTIONS if emotion != "neutral")


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


@pytest.fixture(scope="module")
def cuts(shared_data: Path) -> list[Cut]:
    """Pieces of real motion that nobody has rated."""
    return cuts_of([read(shared_data / f"{name}.bvh") for name in REAL])


@pytest.fixture(scope="module")
def unedited(model: Model, cuts: list[Cut]) -> Reading:
    return read_out(model, [edited(cut, Edit()) for cut in cuts])


@pytest.mark.parametrize("name", REAL)
def test_real_motion_gives_estimates_that_move(cuts, unedited, name):
    mine = [cut.source.name == Path(name).name for cut in cuts]
    assert unedited.spread[mine].max() > 0.03  # over time
    assert unedited.intensity[mine].std(1).mean() > 0.1  # across emotions


def test_real_motion_is_not_saturated(unedited):
    assert ((unedited.intensity > 0.05) & (unedited.intensity < 0.95)).mean() > 0.7


def test_the_sad_take_reads_as_sad_and_lively_ones_do_not(cuts, unedited):
    sadness = unedited.intensity[:, emotion_index("sadness")]
    names = [cut.source.name for cut in cuts]
    means = {name: np.mean([s for s, other in zip(sadness, names, strict=True) if other == name]) for name in names}
    lively = ("elated_reference", "rushed_reference", "79_69", "79_70")
    assert means["79_71"] > 0.5 > 0.2 + max(means[name] for name in lively)


@pytest.fixture(scope="module")
def followed(model: Model, cuts: list[Cut]) -> dict[str, Row]:
    return {row.emotion: row for row in measure(model, cuts)}


@pytest.mark.parametrize("emotion", FELT)
def test_estimates_follow_edits_of_real_motion(followed, emotion):
    """Towards what studies describe; nobody has rated it. The model card has the figures."""
    row = followed[emotion]
    assert row.ordered > 0.7  # 0.5 is chance
    assert row.rank_r > 0.1
    assert row.high - row.low > 0.15  # not constant


def test_most_edits_are_followed(followed):
    assert np.mean([followed[emotion].ordered for emotion in FELT]) > 0.85
    assert np.mean([followed[emotion].rank_r for emotion in FELT]) > 0.3
