"""`python -m bench.counterfactual` measures the direction of estimates, and its measures can tell right from wrong."""

import sys
from pathlib import Path

import numpy as np
import pytest
from bench import counterfactual
from bench.edits import MORE

from fervor.emotions import EMOTIONS, emotion_index
from fervor.model import Model, Outputs, default_model_path
from program import write_bvh


class Thermometer:
    """Stands for a model: every estimate is how far heads are bent forward, or that turned round."""

    def __init__(self, sign: float) -> None:
        self.sign = sign

    def zero_states(self, batch: int) -> dict[str, np.ndarray]:
        return {}

    def run(self, rotations: np.ndarray, mask: np.ndarray, emotion: np.ndarray, states: object) -> Outputs:
        bent = 0.5 + self.sign * rotations[:, :, 2, 0]
        return Outputs(bent, np.repeat(bent[..., None], len(EMOTIONS), -1), {})


@pytest.fixture
def cuts(tmp_path: Path) -> list[counterfactual.Cut]:
    return counterfactual.cuts_of([counterfactual.read(write_bvh(tmp_path / "wave.bvh", seconds=8.0))])


def test_cuts_cover_a_recording(cuts) -> None:
    assert [cut.middle for cut in cuts] == pytest.approx([2.0, 4.0, 6.0])


def test_estimates_that_follow_an_edit_are_told_from_those_that_go_the_other_way(cuts) -> None:
    right, wrong = (
        {row.emotion: row for row in counterfactual.measure(Thermometer(sign), cuts)}  # type: ignore[arg-type]
        for sign in (1.0, -1.0)
    )
    assert set(right) == set(MORE)
    assert right["sadness"].ordered == 1.0 > wrong["sadness"].ordered == 0.0
    assert right["sadness"].rank_r > 0.5 > -0.5 > wrong["sadness"].rank_r
    assert right["sadness"].speed_r == wrong["sadness"].speed_r < 0.0
    assert right["sadness"].own == 0.0  # all emotions rise alike
    assert right["pride"].ordered == 0.0


def test_it_prints_a_row_for_every_emotion_and_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_bvh(tmp_path / "wave.bvh", seconds=4.5)
    monkeypatch.setattr(sys, "argv", ["counterfactual", str(tmp_path)])
    counterfactual.main()
    rows = [line.split("|")[1].strip() for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert [row for row in rows if row in EMOTIONS] == list(MORE)
    assert rows[-1] == "wave"


def test_what_it_reads_is_what_the_model_says(cuts) -> None:
    model = Model.load(default_model_path())
    motion = counterfactual.edited(cuts[0], MORE["sadness"])
    reading = counterfactual.read_out(model, [motion])
    outputs = model.run(
        motion[None].astype(np.float32), np.ones((1, 120, 13), np.float32), np.zeros((1, 120, 11), np.float32),
        model.zero_states(1),
    )  # fmt: skip
    sadness = emotion_index("sadness")
    assert reading.intensity[0, sadness] == pytest.approx(outputs.intensity_by_emotion[0, 30:, sadness].mean())
