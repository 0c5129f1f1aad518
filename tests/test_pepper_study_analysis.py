"""The analysis against a published example and against sums by hand; what can't be compared is said."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from fervor_pepper.study.analysis import analyse, compare
from fervor_pepper.study.answers import Question
from fervor_pepper.study.result import ScaleResult
from fervor_pepper.study.sphericity import sphericity

BUSHTUCKER = np.array(
    [
        [8, 7, 1, 6],
        [9, 5, 2, 5],
        [6, 2, 3, 8],
        [5, 3, 1, 9],
        [8, 4, 5, 8],
        [7, 5, 6, 7],
        [10, 2, 7, 2],
        [12, 6, 8, 1],
    ],
    float,
)
"""Field, Discovering Statistics Using SPSS (3rd ed., 2009), chapter 13: seconds until eight people retch at four
animals."""  # [participant, condition]

SCORES = arrays(np.float64, st.tuples(st.integers(4, 14), st.integers(2, 4)), elements=st.integers(1, 7).map(float))
"""Ratings of 4 to 14 people in 2 to 4 conditions."""


def compared(scores: np.ndarray) -> ScaleResult:
    people, conditions = scores.shape
    return compare("x", [f"P{n}" for n in range(people)], "abcdefgh"[:conditions], scores)


def test_the_published_example() -> None:
    """All figures as the book prints them."""
    result = compared(BUSHTUCKER)
    anova, spherical = result.anova, result.sphericity
    assert (anova.df_conditions, anova.df_error) == (3, 21)
    assert f"{anova.f:.2f} {anova.p:.3f} {anova.p_corrected:.3f}" == "3.79 0.026 0.063"
    assert f"{spherical.w:.3f} {spherical.chi2:.2f} {spherical.df} {spherical.p:.3f}" == "0.136 11.41 5 0.047"
    assert f"{spherical.epsilon:.3f}" == "0.533"
    assert f"{anova.partial_eta2:.3f}" == "0.351"
    assert result.p == anova.p_corrected  # sphericity is violated
    bonferroni = {pair.first + pair.second: f"{pair.p_bonferroni:.3f}" for pair in result.pairs}
    assert bonferroni == {"ab": "0.012", "ac": "0.006", "ad": "1.000", "bc": "1.000", "bd": "1.000", "cd": "1.000"}
    assert [f"{one.mean:.2f}" for one in result.conditions] == ["8.12", "4.25", "4.12", "5.75"]


def varied(scores: np.ndarray) -> bool:
    """Whether conditions differ differently for different people, in every pair."""
    return all(np.std(scores[:, a] - scores[:, b]) > 0 for a, b in combinations(range(scores.shape[1]), 2))


@settings(deadline=None, max_examples=60)
@given(SCORES.filter(varied))
def test_the_anova_is_the_sum_of_squares_by_hand(scores: np.ndarray) -> None:
    people, conditions = scores.shape
    result = compared(scores)
    grand = scores.mean()
    between = people * sum((scores[:, c].mean() - grand) ** 2 for c in range(conditions))
    persons = conditions * sum((scores[p].mean() - grand) ** 2 for p in range(people))
    error = sum((x - grand) ** 2 for x in scores.ravel()) - between - persons
    df, df_error = conditions - 1, (conditions - 1) * (people - 1)
    f = (between / df) / (error / df_error)
    assert result.anova.f == pytest.approx(f, rel=1e-6, abs=1e-9)
    assert result.anova.p == pytest.approx(stats.f.sf(f, df, df_error), rel=1e-6, abs=1e-12)
    assert result.anova.partial_eta2 == pytest.approx(between / (between + error), rel=1e-6, abs=1e-9)
    assert result.anova.generalised_eta2 == pytest.approx(between / (between + persons + error), rel=1e-6, abs=1e-9)
    if conditions == 2:
        t = stats.ttest_rel(scores[:, 0], scores[:, 1]).statistic
        assert result.anova.f == pytest.approx(t**2, rel=1e-6, abs=1e-9)
        assert (result.sphericity.epsilon, result.sphericity.p) == (1.0, None)


@settings(deadline=None, max_examples=60)
@given(SCORES.filter(varied))
def test_pairs_are_the_paired_t_by_hand(scores: np.ndarray) -> None:
    people, conditions = scores.shape
    result = compared(scores)
    tests = math.comb(conditions, 2)
    assert len(result.pairs) == tests
    for pair in result.pairs:
        a, b = (scores[:, "abcdefgh".index(name)] for name in (pair.first, pair.second))
        error = np.std(a - b, ddof=1) / math.sqrt(people)
        p = 2 * stats.t.sf(abs(np.mean(a - b) / error), people - 1)
        half = stats.t.ppf(0.975, people - 1) * error
        assert pair.t == pytest.approx(np.mean(a - b) / error)
        assert pair.p == pytest.approx(p)
        assert pair.p_bonferroni == pytest.approx(min(1.0, tests * p))
        assert (pair.low, pair.high) == pytest.approx((np.mean(a - b) - half, np.mean(a - b) + half))
        pooled = math.sqrt((np.var(a, ddof=1) + np.var(b, ddof=1)) / 2)
        assert pair.d == pytest.approx(np.mean(a - b) / pooled)
        assert pair.d_z == pytest.approx(pair.t / math.sqrt(people))


@settings(deadline=None, max_examples=60)
@given(SCORES.filter(lambda scores: scores.shape[1] > 2 and varied(scores)))
def test_epsilon_is_that_of_the_double_centred_covariance(scores: np.ndarray) -> None:
    """Greenhouse and Geisser's own formula, with no contrasts; and it lies within its bounds."""
    k = scores.shape[1]
    s = np.cov(scores, rowvar=False)
    top = (k * (np.trace(s) / k - s.mean())) ** 2
    bottom = (k - 1) * ((s**2).sum() - 2 * k * (s.mean(1) ** 2).sum() + k**2 * s.mean() ** 2)
    found = sphericity(scores)
    assert found.epsilon == pytest.approx(top / bottom)
    assert 1 / (k - 1) - 1e-9 <= found.epsilon <= 1.0 + 1e-9
    assert found.p is None or 0.0 <= found.p <= 1.0


def test_fourteen_people_in_three_conditions_have_the_papers_degrees_of_freedom() -> None:
    scores = np.random.default_rng(0).integers(1, 8, (14, 3)).astype(float)
    anova = compared(scores).anova
    assert (anova.df_conditions, anova.df_error) == (2, 26)


def form(scores: np.ndarray, scale: str = "warmth") -> dict[Question, int | None]:
    return {
        Question(f"P{person}", "abc"[condition], scale): int(scores[person, condition])
        for person in range(len(scores))
        for condition in range(scores.shape[1])
    }


SOME = np.array([[1, 3, 5], [2, 5, 4], [3, 4, 7], [2, 2, 6], [4, 5, 5]], float)


def test_who_has_no_answer_in_a_condition_is_left_out_and_named() -> None:
    answers = form(SOME)
    answers[Question("P1", "b", "warmth")] = None
    del answers[Question("P3", "c", "warmth")]
    result = analyse(answers)
    (scale,) = result.scales
    assert scale.participants == ("P0", "P2", "P4")
    assert [note for note in result.notes if note.startswith("P")] == [
        "P1 has no answer on warmth in b, and is left out of it",
        "P3 has no answer on warmth in c, and is left out of it",
    ]
    assert scale.anova == compare("warmth", ["P0", "P2", "P4"], "abc", SOME[[0, 2, 4]]).anova


def test_items_are_averaged_and_unequal_numbers_are_told() -> None:
    answers = form(SOME)
    for question, answer in list(answers.items()):
        answers[Question(question.participant, question.condition, "warmth", "2")] = min(7, (answer or 0) + 1)
    del answers[Question("P0", "a", "warmth", "2")]
    result = analyse(answers)
    assert result.scales[0].scores[0] == (1.0, 3.5, 5.5)
    assert "P0 answered unequally many items of warmth; their means are compared" in result.notes


@pytest.mark.parametrize(
    ("scores", "said"),
    [
        (SOME[:2], "2 participants have answers in every condition; expected at least 3"),
        (SOME[:, :1], "there is one condition; expected at least two"),
        (np.full((5, 3), 4.0), "all participants differ between conditions by the same"),
        (SOME[:, :1] + np.arange(3), "all participants differ between conditions by the same"),
    ],
)
def test_what_cannot_be_compared_is_said(scores: np.ndarray, said: str) -> None:
    result = analyse(form(scores))
    assert result.scales == ()
    assert any(note.startswith(f"warmth is not compared: {said}") for note in result.notes)


def test_doubts_are_said() -> None:
    scores = np.random.default_rng(5).integers(3, 5, (14, 3)).astype(float)
    scores[:, 2] = 4 + 3 * (np.arange(14) % 2)
    scores[0] = (7, 7, 1)
    notes = analyse(form(scores)).notes
    assert any("sphericity is violated" in note for note in notes)
    assert any("residuals are not normal" in note for note in notes)
    same = SOME.copy()
    same[:, 1] = same[:, 0] + 1
    assert any(
        "a pair of conditions in which all differ by the same has no t test" in n for n in analyse(form(same)).notes
    )


def test_intervals_within_participants_do_not_see_how_people_differ() -> None:
    shifted = SOME + np.arange(5)[:, None] * 10.0
    before, after = compared(SOME).conditions, compared(shifted).conditions
    assert [one.high - one.low for one in after] == pytest.approx([one.high - one.low for one in before])
