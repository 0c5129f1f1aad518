"""The paper's analysis: per scale a repeated-measures ANOVA, then paired tests with Bonferroni's correction.

Rules. A participant's score in a condition is the mean of the scale's items. Only participants with a score in every
condition are compared; who is left out is said. Nothing is filled in.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats
from statsmodels.stats.anova import AnovaRM
from statsmodels.stats.multitest import multipletests

from fervor_pepper.study.answers import Answers
from fervor_pepper.study.result import Anova, Assumptions, Condition, Pair, ScaleResult, StudyResult
from fervor_pepper.study.sphericity import Sphericity, sphericity

FEWEST = 3
"""Fewest participants of which anything can be said."""

Scores = npt.NDArray[np.float64]
"""[participant, condition]"""


def analyse(answers: Answers, odd: Iterable[str] = ()) -> StudyResult:
    """Compare the conditions on every scale; `odd` is what the reader of the answers noted."""
    conditions = tuple(dict.fromkeys(sorted(question.condition for question in answers)))
    notes, results = list(odd), []
    for scale in dict.fromkeys(question.scale for question in answers):
        participants, scores = _scores(answers, scale, conditions, notes)
        problem = _problem(scores)
        if problem:
            notes.append(f"{scale} is not compared: {problem}")
        else:
            results.append(compare(scale, participants, conditions, scores))
    notes += _doubts(results)
    return StudyResult(conditions, tuple(results), tuple(notes))


def compare(scale: str, participants: Sequence[str], conditions: Sequence[str], scores: Scores) -> ScaleResult:
    """Compare conditions on one scale.

    Args:
        scale: its name.
        participants: [participant] codes, at least three.
        conditions: [condition] names, at least two.
        scores: [participant, condition], not all the same.
    """
    spherical = sphericity(scores)
    return ScaleResult(
        scale,
        tuple(participants),
        tuple(map(tuple, scores.tolist())),
        tuple(_conditions(conditions, scores)),
        _anova(scores, spherical),
        spherical,
        tuple(_pairs(conditions, scores)),
        _assumptions(scores),
    )


def _scores(answers: Answers, scale: str, conditions: Sequence[str], notes: list[str]) -> tuple[list[str], Scores]:
    """Those with a score in every condition, and their scores; notes who is left out."""
    cells: dict[tuple[str, str], list[int]] = {}
    for question, answer in answers.items():
        if question.scale == scale:
            given = cells.setdefault((question.participant, question.condition), [])
            given += [] if answer is None else [answer]
    kept, rows = [], []
    for participant in dict.fromkeys(participant for participant, _ in cells):
        row = [cells.get((participant, condition), []) for condition in conditions]
        missing = [condition for condition, given in zip(conditions, row, strict=True) if not given]
        if missing:
            notes.append(f"{participant} has no answer on {scale} in {', '.join(missing)}, and is left out of it")
            continue
        if len({len(given) for given in row}) > 1:
            notes.append(f"{participant} answered unequally many items of {scale}; their means are compared")
        kept.append(participant)
        rows.append([sum(given) / len(given) for given in row])
    return kept, np.asarray(rows, np.float64).reshape(len(rows), len(conditions))


def _problem(scores: Scores) -> str | None:
    """Why scores can't be compared."""
    participants, conditions = scores.shape
    if conditions < 2:
        return "there is one condition; expected at least two"
    if participants < FEWEST:
        return f"{participants} participants have answers in every condition; expected at least {FEWEST}"
    if np.allclose(_residuals(scores), 0.0):
        return "all participants differ between conditions by the same; there is no error to compare with"
    return None


def _conditions(names: Sequence[str], scores: Scores) -> Iterable[Condition]:
    participants, conditions = scores.shape
    within = scores - scores.mean(1, keepdims=True) + scores.mean()
    morey = math.sqrt(conditions / (conditions - 1))
    half = stats.t.ppf(0.975, participants - 1) * within.std(0, ddof=1) / math.sqrt(participants) * morey
    for name, column, side in zip(names, scores.T, half, strict=True):
        mean = float(column.mean())
        yield Condition(name, mean, float(column.std(ddof=1)), mean - float(side), mean + float(side))


def _anova(scores: Scores, spherical: Sphericity) -> Anova:
    participants, conditions = scores.shape
    table = pd.DataFrame(
        {
            "participant": np.repeat(np.arange(participants), conditions),
            "condition": np.tile(np.arange(conditions), participants),
            "score": scores.ravel(),
        }
    )
    row = AnovaRM(table, "score", "participant", within=["condition"]).fit().anova_table.iloc[0]
    f, df, df_error = float(row["F Value"]), round(row["Num DF"]), round(row["Den DF"])
    corrected = stats.f.sf(f, spherical.epsilon * df, spherical.epsilon * df_error)
    between = participants * np.sum((scores.mean(0) - scores.mean()) ** 2)
    whole = np.sum((scores - scores.mean()) ** 2)
    partial = f * df / (f * df + df_error)
    return Anova(f, df, df_error, float(row["Pr > F"]), float(corrected), partial, float(between / whole))


def _pairs(names: Sequence[str], scores: Scores) -> list[Pair]:
    found = []
    for first, second in combinations(range(len(names)), 2):
        a, b = scores[:, first], scores[:, second]
        spread = float(np.std(a - b, ddof=1))
        if spread == 0.0:
            continue  # everybody differs by the same: t has no meaning
        test = stats.ttest_rel(a, b)
        low, high = test.confidence_interval(0.95)
        mean = float(np.mean(a - b))
        both = math.sqrt((np.var(a, ddof=1) + np.var(b, ddof=1)) / 2.0)
        d = mean / both if both else math.inf
        found.append((names[first], names[second], mean, float(low), float(high), test, d, mean / spread))
    count = len(names) * (len(names) - 1) // 2
    raw = [float(test.pvalue) for *_, test, _, _ in found]
    # Pairs without a test count too: they were meant to be compared.
    corrected = multipletests([*raw, *[1.0] * (count - len(raw))], method="bonferroni")[1]
    return [
        Pair(first, second, mean, low, high, float(test.statistic), len(scores) - 1, p, float(whole), d, d_z)
        for (first, second, mean, low, high, test, d, d_z), p, whole in zip(found, raw, corrected, strict=False)
    ]


def _assumptions(scores: Scores) -> Assumptions:
    shapiro = stats.shapiro(_residuals(scores).ravel())
    if scores.shape[1] > 2:
        name, rank = "Friedman", stats.friedmanchisquare(*scores.T).pvalue
    else:
        name, rank = "Wilcoxon", stats.wilcoxon(scores[:, 0], scores[:, 1]).pvalue
    return Assumptions(float(shapiro.statistic), float(shapiro.pvalue), name, float(rank))


def _residuals(scores: Scores) -> Scores:
    """What neither participant nor condition explains."""
    means = scores.mean(1, keepdims=True) + scores.mean(0, keepdims=True)  # [participant, condition]
    return np.asarray(scores - means + scores.mean())


def _doubts(results: Iterable[ScaleResult]) -> Iterable[str]:
    for result in results:
        if result.sphericity.violated:
            yield f"{result.scale}: sphericity is violated (p = {result.sphericity.p:.3f}); read the corrected p"
        if result.assumptions.shapiro_p is not None and result.assumptions.shapiro_p < 0.05:
            yield (
                f"{result.scale}: residuals are not normal (Shapiro-Wilk p = {result.assumptions.shapiro_p:.3f}); "
                f"compare with the {result.assumptions.rank_test} test"
            )
        if len(result.pairs) < math.comb(len(result.conditions), 2):
            yield f"{result.scale}: a pair of conditions in which all differ by the same has no t test"
