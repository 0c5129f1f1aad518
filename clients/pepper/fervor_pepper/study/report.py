"""The analysis as JSON and as one HTML file that needs nothing else; what is odd or missing comes first."""

import base64
import json
from collections.abc import Sequence
from dataclasses import asdict
from html import escape

from fervor import __version__
from fervor_pepper.study import plots
from fervor_pepper.study.result import Pair, ScaleResult, StudyResult
from fervor_pepper.study.sessions import Doings

STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1c1c1c; max-width: 58rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.4rem; }
table { border-collapse: collapse; margin: .8rem 0; } th, td { padding: .25rem .8rem .25rem 0; text-align: right; }
th:first-child, td:first-child { text-align: left; } thead th { border-bottom: 2px solid #1c1c1c; }
tbody tr { border-bottom: 1px solid #e2e2e2; } td { font-variant-numeric: tabular-nums; }
.warn { background: #fff3d6; border-left: 5px solid #e69f00; padding: .6rem 1rem; margin: .5rem 0; }
img { width: 26rem; max-width: 100%; } p.note, small { color: #555; } .main { font-weight: 600; }
"""


def to_json(result: StudyResult, doings: Sequence[Doings]) -> str:
    """Everything, as one JSON object."""
    sessions = [one.as_dict() for one in doings]
    return json.dumps({**asdict(result), "sessions": sessions, "fervor": __version__}, indent=2)


def to_html(result: StudyResult, doings: Sequence[Doings], *, title: str) -> str:
    """The report."""
    parts = [
        f"<h1>Study {escape(title)}</h1>",
        *(f'<p class="warn">{escape(note)}.</p>' for note in result.notes),
        *(part for scale in result.scales for part in _scale(scale)),
        *_sessions(doings),
        "<h2>How to read it</h2>",
        "<p class='note'>Repeated-measures ANOVA with participants who answered in every condition. p is corrected "
        "(Greenhouse-Geisser) where Mauchly's test finds sphericity violated. Pairs: paired t tests, p times the "
        "number of pairs (Bonferroni); d: difference over the mean SD of both, d_z: over its own. Intervals of means "
        "are within participants (Cousineau, Morey); those of differences are not corrected.</p>",
        f"<p><small>fervor {__version__}</small></p>",
    ]
    head = f'<meta charset="utf-8"><title>Study {escape(title)}</title><style>{STYLE}</style>'
    body = "\n".join(parts)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def sentence(scale: ScaleResult) -> str:
    """The ANOVA as a paper would say it."""
    anova, epsilon = scale.anova, scale.sphericity.epsilon
    corrected = scale.sphericity.violated
    df = [anova.df_conditions, anova.df_error]
    shown = ", ".join(f"{epsilon * value:.2f}" if corrected else str(value) for value in df)
    return (
        f"F({shown}) = {anova.f:.2f}, {said_p(scale.p)}, partial η² = {anova.partial_eta2:.2f}, "
        f"generalised η² = {anova.generalised_eta2:.2f}, n = {len(scale.participants)}"
    )


def assumptions(scale: ScaleResult) -> str:
    """What was checked, in one line."""
    checked = []
    if scale.sphericity.p is not None:
        checked.append(f"Mauchly W = {scale.sphericity.w:.2f}, {said_p(scale.sphericity.p)}")
    if len(scale.conditions) > 2:
        checked.append(f"ε = {scale.sphericity.epsilon:.2f}, corrected {said_p(scale.anova.p_corrected)}")
    if scale.assumptions.shapiro_p is not None:
        checked.append(f"Shapiro-Wilk {said_p(scale.assumptions.shapiro_p)}")
    if scale.assumptions.rank_p is not None:
        checked.append(f"{scale.assumptions.rank_test} {said_p(scale.assumptions.rank_p)}")
    return "; ".join(checked)


def said_p(p: float) -> str:
    """A p value as papers write it."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def pair_cells(pair: Pair) -> list[str]:
    """A pair as cells of a table."""
    return [
        f"{pair.first} - {pair.second}",
        f"{pair.difference:+.2f} [{pair.low:.2f}, {pair.high:.2f}]",
        f"{pair.t:.2f}",
        str(pair.df),
        said_p(pair.p).removeprefix("p ").removeprefix("= "),
        said_p(pair.p_bonferroni).removeprefix("p ").removeprefix("= "),
        f"{pair.d:.2f}",
        f"{pair.d_z:.2f}",
    ]


PAIR_HEAD = ("pair", "difference [95 %]", "t", "df", "p", "p Bonferroni", "d", "d_z")
CONDITION_HEAD = ("condition", "mean [95 %]", "SD")
SESSION_HEAD = ("condition", "sessions", "people", "minutes", "spoken", "gestures", "failed", "strong")


def condition_cells(scale: ScaleResult) -> list[list[str]]:
    """Each condition as cells of a table."""
    return [[one.name, f"{one.mean:.2f} [{one.low:.2f}, {one.high:.2f}]", f"{one.sd:.2f}"] for one in scale.conditions]


def session_cells(doings: Sequence[Doings]) -> list[list[str]]:
    """What the robot did, as cells of a table."""
    return [
        [
            one.condition,
            str(one.sessions),
            str(len(one.participants)),
            f"{one.seconds / 60:.1f}",
            str(one.spoken),
            str(one.gestures),
            str(one.failed),
            f"{one.strong / one.estimates:.0%}" if one.estimates else "-",
        ]
        for one in doings
    ]


def _scale(scale: ScaleResult) -> list[str]:
    image = base64.b64encode(plots.ratings(scale).encode()).decode()
    means = ", ".join(f"{one.name} {one.mean:.2f}" for one in scale.conditions)
    return [
        f"<h2>{escape(scale.scale)}</h2>",
        f'<p class="main">{escape(sentence(scale))}</p>',
        f"<p><small>{escape(assumptions(scale))}</small></p>",
        f'<img alt="Ratings of {escape(scale.scale)}: {escape(means)}" src="data:image/svg+xml;base64,{image}">',
        _table(CONDITION_HEAD, condition_cells(scale)),
        _table(PAIR_HEAD, [pair_cells(pair) for pair in scale.pairs]),
    ]


def _sessions(doings: Sequence[Doings]) -> list[str]:
    if not doings:
        return []
    return ["<h2>What the robot did</h2>", _table(SESSION_HEAD, session_cells(doings))]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
