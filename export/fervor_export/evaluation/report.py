"""The report: one HTML file that needs nothing else, with the warnings first and the paper's table next."""

import base64
import csv
import io
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from fervor.emotions import UNKNOWN
from fervor_export.evaluation import plots
from fervor_export.evaluation.evaluate import ACTORS, GIVEN, HELD_OUT, RECORDINGS, Evaluated
from fervor_export.evaluation.metrics import Figure
from fervor_export.evaluation.protocols import NETWORK, PREDICTORS, Run
from fervor_export.evaluation.result import Evaluation, ProtocolResult
from fervor_export.evaluation.terminal import PAPER

STYLE = """
:root { color-scheme: light dark; --ink: #1c1c1c; --page: #fff; --quiet: #555; --line: #dcdcdc; --code: #f2f2f2;
  --warn: #fff3d6; --demo: #fde3dc; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e6e6; --page: #16181b; --quiet: #a8a8a8; --line: #3a3d42;
  --code: #26292e; --warn: #3a3018; --demo: #45241b; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page);
  max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; margin-bottom: 0; } h2 { font-size: 1.2rem; margin-top: 2.4rem; } h3 { font-size: 1rem; }
table { border-collapse: collapse; margin: .8rem 0; } th, td { padding: .25rem .8rem .25rem 0; text-align: left; }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; }
tbody tr { border-bottom: 1px solid var(--line); }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; } small { color: var(--quiet); }
td { white-space: nowrap; } td small { display: block; font-size: .78rem; font-weight: 400; line-height: 1.2; }
.main td { font-weight: 600; } .warn { background: var(--warn); border-left: 5px solid #e69f00; padding: .6rem 1rem; }
.warn.demo { background: var(--demo); border-color: #d55e00; font-weight: 600; }
.plots { display: flex; flex-wrap: wrap; gap: 1rem 1.6rem; align-items: flex-start; }
figure { margin: 0; flex: 0 1 29rem; } img { width: 100%; background: #fff; border-radius: 4px; }
figcaption { max-width: 30rem; color: var(--quiet); font-size: .88rem; }
p.note { color: var(--quiet); max-width: 46rem; } code { background: var(--code); padding: 0 .25em; }
"""

Cell = str | Figure | float | int | None


def write(evaluated: Evaluated, directory: Path) -> None:
    """Write `evaluation.html`, `evaluation.json` and `predictions.csv` into a directory, which is made."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "evaluation.html").write_text(html(evaluated), encoding="utf-8")
    (directory / "evaluation.json").write_text(evaluated.result.to_json(), encoding="utf-8")
    (directory / "predictions.csv").write_text(predictions_csv(evaluated.runs), encoding="utf-8")


def html(evaluated: Evaluated) -> str:
    """The report."""
    result = evaluated.result
    parts = [
        f"<h1>Evaluation of {escape(result.model)}</h1>",
        f"<p><small>{escape(result.data.source)} · seed {result.seed}, fervor {result.libraries['fervor']}</small></p>",
        *_warnings(result),
        *_main_table(result),
        *_data(result),
        *(part for protocol in result.protocols for part in _protocol(protocol, evaluated.runs[protocol.name])),
        *_invariance(result),
        *_drift(result),
        *_thresholds(result),
    ]
    body = "\n".join(parts)
    head = f'<meta charset="utf-8"><title>Evaluation of {escape(result.model)}</title><style>{STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def predictions_csv(runs: Mapping[str, Run]) -> str:
    """Every clip with what everybody said of it."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(["protocol", "fold", "recording", "actor", "emotion", "intensity", "observers", *PREDICTORS])
    for name, run in runs.items():
        for index, clip in enumerate(run.clips):
            said = [run.predictions[predictor][index] for predictor in PREDICTORS]
            observers = "" if clip.observers is None else clip.observers
            row = [name, run.folds[index] + 1, clip.name, clip.actor, clip.emotion, f"{clip.intensity:.6g}", observers]
            table.writerow([*row, *("" if value != value else f"{value:.6f}" for value in said)])  # noqa: PLR0124  # nan
    return out.getvalue()


def _warnings(result: Evaluation) -> list[str]:
    shown = [
        f'<p class="warn{" demo" if result.data.procedural and not index else ""}">{escape(warning)}</p>'
        for index, warning in enumerate(result.warnings)
    ]
    for name, why in result.skipped.items():
        shown.append(f'<p class="warn">Not done: {escape(_protocol_name(name))}. {escape(why)}.</p>')
    return shown


def _main_table(result: Evaluation) -> list[str]:
    """The paper's table, and leave-one-actor-out next to it."""
    head = ["", *(text for protocol in result.protocols for text in _columns(protocol)), "paper, 5 folds: r"]
    rows = [
        [title]
        + [
            cell
            for protocol in result.protocols
            for predictor in protocol.predictors
            if predictor.name == name
            for cell in (predictor.scores.r_all, predictor.scores.r_within)
        ]
        + [_paper(name)]
        for name, title in PREDICTORS.items()
        if any(predictor.name == name for protocol in result.protocols for predictor in protocol.predictors)
    ]
    ceilings: list[Cell] = ["noise ceiling"]
    for protocol in result.protocols:
        ceilings += [protocol.ceilings.r_all, protocol.ceilings.r_within]
    note = (
        "<p class='note'><b>Read the column <i>within emotion</i>.</b> Emotions differ in how well they are "
        "recognised, so whoever knows the label alone has a pooled r above zero. Within an emotion movement is left. "
        "Rows below the baseline are controls: what can be had without learning movement, and the network under a "
        "wrong label or none. <b>Actors left out</b> is what a robot meets: people it has not learned from. Below: "
        "95 % intervals, actors resampled. The paper's numbers are of another data set, for orientation only.</p>"
    )
    table = _table(head, [*rows, [*ceilings, ""]], strong=(0, 1))
    return ["<h2>Pearson r</h2>", table, note]


def _paper(name: str) -> str:
    return f"about {PAPER[name]}" if name == NETWORK else PAPER.get(name, "")


def _columns(protocol: ProtocolResult) -> tuple[str, str]:
    return f"{protocol.title}: r, all clips pooled", "within emotion"


def _data(result: Evaluation) -> list[str]:
    data = result.data
    facts = (
        f"{data.clips} clips of {data.recordings} recordings and {len(data.actors)} actors, {data.minutes:g} minutes"
    )
    observers = "unknown" if data.observers is None else f"{data.observers:g} on average"
    emotions = _table(["emotion", "clips"], [[name, count] for name, count in data.emotions.items()])
    plot = _figure(plots.svg(plots.actors(data.actors), height=2.8), "Clips of each actor.")
    return [
        "<h2>Data</h2>",
        f"<p>{facts}; observers of a clip: {observers}. SHA-256 <code>{data.sha256[:16]}…</code></p>",
        f'<div class="plots">{emotions}{plot}</div>',
    ]


def _protocol(protocol: ProtocolResult, run: Run) -> list[str]:
    head = ["", "r, all", "r, no neutral", "r within", "CCC", "MAE", "spread", "r by fold: mean"]
    rows: list[list[Cell]] = []
    for predictor in protocol.predictors:
        scores = predictor.scores
        folds = [value for value in predictor.r_folds if value is not None]
        figures = (scores.r_all, scores.r, scores.r_within, scores.ccc, scores.mae, scores.spread)
        rows.append([predictor.title, *figures, sum(folds) / len(folds) if folds else None])
    ahead: list[list[Cell]] = [
        ["network, minus baseline", protocol.network_minus_baseline],
        ["network, minus joint speed by emotion", protocol.network_minus_speed],
    ]
    levels = protocol.levels.balanced_accuracy
    drawn = [
        (plots.scatter(run), 4.2, _agreement(protocol)),
        (plots.by_emotion(protocol, run.clips), 3.6, "Within each emotion; neutral is no intensity and stands apart."),
        (plots.calibration(protocol), 4.0, f"Calibration; expected error {_number(protocol.reliability.error)}."),
        (plots.by_seconds(protocol), 3.6, "By seconds seen; shorter clips count whole."),
        (
            plots.confusion(protocol.levels),
            3.4,
            f"Levels, thresholds of other folds; balanced accuracy {_number(levels)}.",
        ),
    ]
    shown = "".join(_figure(plots.svg(draw, height=height), text) for draw, height, text in drawn)
    return [
        f"<h2>{escape(protocol.title.capitalize())}</h2>",
        _table(head, rows, strong=(0, 1)),
        "<p>Ahead within emotions, on the same resampled actors:</p>",
        _table(["", "difference of r within"], ahead),
        f'<div class="plots">{shown}</div>',
        *_trainings(protocol),
    ]


def _agreement(protocol: ProtocolResult) -> str:
    """What stands below the predictions."""
    r = protocol.predictor(NETWORK).scores.r
    interval = "" if r.low is None else f" [{_number(r.low)}, {_number(r.high)}]"
    return f"Predictions of clips that were not learned from; r without neutral {_number(r.value)}{interval}."


def _trainings(protocol: ProtocolResult) -> list[str]:
    if protocol.name == HELD_OUT:
        return []
    rows: list[list[Cell]] = [
        [number, fold.train_clips, fold.test_clips, fold.epochs, fold.best_epoch, fold.stopped, fold.seconds]
        for number, fold in enumerate(protocol.trainings, start=1)
    ]
    head = ["fold", "clips learned from", "judged", "epochs", "best", "ended by", "seconds"]
    return [f"<details><summary>Training of each fold</summary>{_table(head, rows)}</details>"]


def _invariance(result: Evaluation) -> list[str]:
    rows: list[list[Cell]] = [
        [
            change.title,
            f"{change.mean:.1e}",
            f"{change.most:.1e}",
            change.r_before,
            change.r_after,
            ("kept" if change.kept else "BROKEN") if change.promised else "",
        ]
        for change in result.changes
    ]
    head = ["seen otherwise", "mean change", "largest", "r within before", "after", "no change promised"]
    clips = result.changes[0].clips if result.changes else 0
    note = (
        f"<p class='note'>Predictions of {clips} clips by networks that have not learned from them. Bones and the "
        "turned camera with points are compared with the same landmark sensor, undisturbed. 60 and 120 Hz are "
        "streams whose first frame falls between two of the clip, so that all poses are interpolated.</p>"
    )
    return ["<h2>Invariance</h2>", _table(head, rows), note]


def _drift(result: Evaluation) -> list[str]:
    rows: list[list[Cell]] = [
        [
            drift.memory,
            Figure(drift.slope, drift.slope_low, drift.slope_high),
            drift.apart,
            *(minute.r for minute in drift.minutes),
        ]
        for drift in result.drifts
    ]
    if not rows:
        return []
    minutes = [f"r, minute {number}" for number in range(1, len(result.drifts[0].minutes) + 1)]
    head = ["memory", "slope a minute", "mean |difference|", *minutes]
    plot = _figure(plots.svg(plots.over_minutes(result.drifts)), "Estimates over one long stream of clips.")
    note = (
        f"<p class='note'>{result.drifts[0].streams} streams of clips one after the other. Slope and difference are "
        "those of the estimate minus the estimate of the same frame from a fresh state.</p>"
    )
    return ["<h2>Drift over minutes</h2>", _table(head, rows), note, f'<div class="plots">{plot}</div>']


def _thresholds(result: Evaluation) -> list[str]:
    chosen = result.thresholds
    balanced = next(item for item in result.protocols if item.name == chosen.protocol).levels.emotions
    rows: list[list[Cell]] = [
        [
            name,
            value,
            "own" if name in chosen.own else "own" if name == UNKNOWN else "common",
            chosen.boundary.get(name),
            balanced.get(name),
        ]
        for name, value in chosen.rule.threshold.items()
    ]
    head = ["emotion", "strong from", "threshold", "true intensity from", "balanced accuracy"]
    note = (
        f"<p class='note'>From the predictions of {escape(_protocol_name(chosen.protocol))}. Balanced accuracy: with "
        "thresholds chosen in the other folds.</p>"
    )
    return ["<h2>Thresholds between weak and strong</h2>", _table(head, rows), note]


def _protocol_name(name: str) -> str:
    return {
        GIVEN: "the data's own split",
        RECORDINGS: "folds by recording",
        ACTORS: "leaving actors out",
        HELD_OUT: "held-out clips",
    }[name]


def _table(head: Sequence[str], rows: Sequence[Sequence[Cell]], *, strong: Sequence[int] = ()) -> str:
    cells = "".join(f"<th{_side(index)}>{escape(text)}</th>" for index, text in enumerate(head))
    lines = []
    for number, row in enumerate(rows):
        shown = "".join(f"<td{_side(index)}>{_shown(cell)}</td>" for index, cell in enumerate(row))
        lines.append(f"<tr{' class=main' if number in strong else ''}>{shown}</tr>")
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _side(column: int) -> str:
    return ' class="n"' if column else ""


def _shown(cell: Cell) -> str:
    if isinstance(cell, Figure):
        interval = "" if cell.low is None else f" <small>[{_number(cell.low)}, {_number(cell.high)}]</small>"
        return f"{_number(cell.value)}{interval}"
    if isinstance(cell, str):
        return escape(cell)
    return str(cell) if isinstance(cell, int) else _number(cell)


def _number(value: float | None) -> str:
    """Three digits; a dash where there is no number."""
    if value is None:
        return "-"
    digits = 4 if 0 < abs(value) < 0.01 else 3
    shown = f"{value:.{digits}f}"
    return shown.strip("-") if not float(shown) else shown.replace("-", "\N{MINUS SIGN}")


def _figure(drawn: str, caption: str) -> str:
    data = base64.b64encode(drawn.encode()).decode()
    image = f'<img alt="{escape(caption)}" src="data:image/svg+xml;base64,{data}">'
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"
