"""A data set's report: tables for a terminal, and one HTML file with plots that needs nothing beside it."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from rich.console import Console
from rich.table import Table
from rich.text import Text

from fervor_export.data.dataset import Dataset
from fervor_export.data.listing import Finding, Severity
from fervor_export.data.plots import plots
from fervor_export.data.summary import CEILING_SOURCE, Group, Summary

SEVERITIES: Mapping[Severity, str] = {
    "unusable": "Left out: can't be used",
    "doubt": "Used, but look at it",
    "skipped": "Left out: known to be broken",
}
"""How findings are headed, in this order."""

REPEATS = "Repeats: never on both sides of a fold"
"""How the findings of less exact copies are headed."""

GROUP_COLUMNS = ("clips", "minutes", "mean", "deviation", "ceiling")

_STYLE = """:root{color-scheme:light dark;--ink:#222;--page:#fff;--line:#ddd;--quiet:#555;--bad:#a00;--doubt:#850}
@media(prefers-color-scheme:dark){:root{--ink:#e6e6e6;--page:#16181b;--line:#3a3d42;--quiet:#a8a8a8;--bad:#ff8a80;
--doubt:#e6b566}}
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:var(--ink);
background:var(--page)}
table{border-collapse:collapse;margin:.5rem 0 1.5rem}td,th{padding:.15rem .8rem;text-align:left;vertical-align:top;
border-bottom:1px solid var(--line);overflow-wrap:anywhere}td.n{text-align:right;font-variant-numeric:tabular-nums}
img{max-width:100%;background:#fff;border-radius:4px}
.unusable{color:var(--bad)}.doubt{color:var(--doubt)}p.note{color:var(--quiet)}"""


def facts(summary: Summary) -> list[tuple[str, str]]:
    """What concerns the whole data set, by name."""
    shortest, median, longest = summary.seconds
    told = [
        ("data", summary.description),
        ("clips", f"{summary.clips} of {summary.recordings} recordings, {summary.hours:.2f} h"),
        ("length of clips", f"{shortest:.1f} to {longest:.1f} s, median {median:.1f} s" if summary.clips else ""),
        ("observers of a clip", _counted(summary.observers)),
        ("frames a second", _counted(summary.rates)),
        ("skeletons", _counted(summary.skeletons)),
        ("splits", _counted(summary.splits)),
        ("T-pose dropped", f"{summary.t_poses} recordings" if summary.t_poses else ""),
        ("without a label", f"{summary.unlabelled} recordings" if summary.unlabelled else ""),
        ("noise ceiling", f"{summary.ceiling:.2f}, the largest r with labels of so few" if summary.ceiling else ""),
        ("SHA-256", summary.sha256),
    ]
    return [(name, value) for name, value in told if value]


def print_report(console: Console, data: Dataset, summary: Summary) -> None:
    """The report as tables."""
    table = Table(show_header=False, box=None)
    for name, value in facts(summary):
        table.add_row(Text(name, "bold"), Text(value))
    console.print(table)
    for title, others, groups in _group_tables(summary):
        shown = Table(title=title, title_justify="left")
        shown.add_column(title.split()[-1])
        for column in (GROUP_COLUMNS[0], others, *GROUP_COLUMNS[1:]):
            shown.add_column(column, justify="right")
        for group in groups:
            shown.add_row(*_cells(group))
        console.print(shown)
    for severity, title in SEVERITIES.items():
        _print_findings(console, title, [finding for finding in data.findings if finding.severity == severity])
    _print_findings(console, REPEATS, _repeats(summary))


def _print_findings(console: Console, title: str, findings: Sequence[Finding]) -> None:
    if findings:
        console.print(Text(f"{title} ({len(findings)})", "bold"))
    for finding in findings:
        console.print(Text(f"  {finding}"), soft_wrap=True)


def html_report(data: Dataset, summary: Summary) -> str:
    """The report as one page; plots are inside."""
    parts = ["<h1>Data set</h1>", _html_rows(facts(summary))]
    parts += [
        f"<h2>{SEVERITIES[severity]} ({len(found)})</h2>{_html_findings(found)}" for severity, found in _sorted(data)
    ]
    if repeats := _repeats(summary):
        parts.append(f"<h2>{REPEATS} ({len(repeats)})</h2>{_html_findings(repeats)}")
    for title, others, groups in _group_tables(summary):
        head = (title.split()[-1], GROUP_COLUMNS[0], others, *GROUP_COLUMNS[1:])
        parts.append(f"<h2>{escape(title)}</h2>{_html_table(head, map(_cells, groups))}")
    parts.append(f'<p class="note">{escape(CEILING_SOURCE)}</p>')
    for title, svg in plots(data).items():
        image = base64.b64encode(svg.encode()).decode()
        parts.append(f'<h2>{escape(title)}</h2><img alt="{escape(title)}" src="data:image/svg+xml;base64,{image}">')
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>fervor data set</title>'
        f"<style>{_STYLE}</style></head>\n<body>{body}</body></html>\n"
    )


def _sorted(data: Dataset) -> list[tuple[Severity, list[Finding]]]:
    found = [(severity, [one for one in data.findings if one.severity == severity]) for severity in SEVERITIES]
    return [(severity, findings) for severity, findings in found if findings]


def _repeats(summary: Summary) -> list[Finding]:
    return [Finding("doubt", name, f"moves as {first} does") for name, first in summary.repeats.items()]


def _group_tables(summary: Summary) -> list[tuple[str, str, Sequence[Group]]]:
    """Title, what else is counted, and rows."""
    tables: list[tuple[str, str, Sequence[Group]]] = [
        ("Clips by emotion", "actors", summary.emotions),
        ("Apart, as it is no intensity: the neutral emotion", "actors", [summary.neutral] if summary.neutral else []),
        ("Clips by actor", "emotions", summary.actors),
    ]
    return [table for table in tables if table[2]]


def _cells(group: Group) -> tuple[str, ...]:
    numbers = map(_number, (group.mean, group.deviation, group.ceiling))
    return (group.name, str(group.clips), str(group.others), f"{group.minutes:.1f}", *numbers)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in counts.items())


def _html_rows(rows: Iterable[tuple[str, str]]) -> str:
    return "<table>" + "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows) + "</table>"


def _html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join(
        f"<tr><td>{escape(first)}</td>" + "".join(f'<td class="n">{escape(cell)}</td>' for cell in cells) + "</tr>"
        for first, *cells in rows
    )
    return f"<table><tr>{top}</tr>{body}</table>"


def _html_findings(findings: Iterable[Finding]) -> str:
    rows = "".join(
        f'<tr class="{one.severity}"><td>{escape(one.where)}</td><td>{escape(one.what)}</td></tr>' for one in findings
    )
    return f"<table>{rows}</table>"
