"""Columns and messages say the same, and a summary is of the frames that count."""

import numpy as np
import pytest

from bodies import model, motion, terms
from fervor.scoring.scored import Scored, summarise
from fervor.scoring.scorer import Scorer
from fervor.scoring.take import Take


def scored(frames: int, **changes) -> Scored:
    observed = np.ones((frames, 13), np.bool_)
    observed[: frames // 50] = False
    item = Take("walk", np.arange(frames) / 50.0, motion(frames), observed, "joy")
    return Scorer(model()).score([item], terms(**changes))[0]


@pytest.mark.parametrize("by_emotion", [False, True])
def test_columns_of_estimates_give_them_back(by_emotion: bool) -> None:
    estimates = scored(200, by_emotion=by_emotion).estimates()
    assert estimates[0].intensity is None
    assert Scored.of("walk", estimates).estimates() == estimates


def test_a_summary_is_of_the_settled_frames() -> None:
    whole = scored(200)
    summary, estimates = summarise(whole), whole.estimates()
    settled = [estimate.intensity for estimate in estimates if estimate.status == "ok"]
    assert (summary.name, summary.frames, summary.emotion) == ("walk", 200, "joy")
    assert summary.duration_s == pytest.approx(3.98)
    assert summary.mean == np.mean(settled)
    assert summary.peak == max(settled)
    assert (summary.last, summary.level) == (estimates[-1].intensity, estimates[-1].level)
    assert summary.strong == np.mean([estimate.level == "strong" for estimate in estimates])


def test_a_short_take_is_summed_up_from_what_there_is() -> None:
    summary = summarise(scored(10))
    assert summary.mean is not None
    empty = summarise(Scored.of("x", []))
    assert (empty.mean, empty.peak, empty.last, empty.level, empty.frames) == (None, None, None, None, 0)
