"""An evaluation on a terminal: warnings, the paper's table, everybody's agreement, and what else the report says."""

from collections.abc import Iterable, Sequence
from textwrap import wrap

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fervor_export.evaluation.metrics import Figure
from fervor_export.evaluation.observed import Glance
from fervor_export.evaluation.protocols import BASELINE, NETWORK, PREDICTORS
from fervor_export.evaluation.result import Evaluation, PredictorResult, ProtocolResult

PAPER = {NETWORK: "0.8", BASELINE: "0.46"}
"""Sun et al., section IV-C: Pearson r of five folds; whether copies of clips stood on both sides it does not say."""


def print_evaluation(console: Console, result: Evaluation) -> None:
    """Print what a reader must know, then the numbers; the report has all of them."""
    for index, warning in enumerate(result.warnings):
        style = "bold red" if result.data.procedural and not index else "yellow"
        console.print(escape(warning), style=style)
    for name, why in result.skipped.items():
        console.print(escape(f"not done: {name}: {why}"), style="yellow")
    for table in (_papers(result), _agreement(result), _more(result), _invariance(result), _drift(result)):
        console.print(table)


def _papers(result: Evaluation) -> Table:
    """Network beside baseline, folds beside actors left out: r of all clips, pooled."""
    table = _table("Pearson r, all clips pooled [95 %, actors resampled]", ["", "LSTM", "SVM", "noise ceiling"])
    for protocol in result.protocols:
        both = (_interval(protocol.predictor(name).scores.r_all) for name in (NETWORK, BASELINE))
        table.add_row(protocol.title, *both, _number(protocol.ceilings.r_all))
    table.add_row("[dim]the paper, 5 folds[/]", *(f"[dim]{PAPER[name]}[/]" for name in (NETWORK, BASELINE)), "")
    return table


def _agreement(result: Evaluation) -> Table:
    """Everybody's r within emotions."""
    head = ["", *("\n".join(wrap(protocol.title, 16)) for protocol in result.protocols)]
    table = _table("Pearson r within emotions, neutral apart", head)
    for name, title in PREDICTORS.items():
        found = [_found(protocol, name) for protocol in result.protocols]
        if any(found):
            table.add_row(title, *("-" if one is None else _interval(one.scores.r_within) for one in found))
    table.add_row("noise ceiling", *(_number(protocol.ceilings.r_within) for protocol in result.protocols))
    return table


def _more(result: Evaluation) -> Table:
    """What else there is to say of the network."""
    head = ["", *("\n".join(wrap(protocol.title, 16)) for protocol in result.protocols)]
    table = _table("The network, neutral apart", head)
    for name, cells in zip(_NAMES, zip(*map(_figures, result.protocols), strict=True), strict=True):
        table.add_row(name, *cells)
    seconds = [
        {glance.seconds: glance for glance in protocol.seconds if glance.seconds} for protocol in result.protocols
    ]
    for after in sorted({second for glances in seconds for second in glances if second}):
        table.add_row(f"r within after {after:g} s", *(_glanced(glances.get(after)) for glances in seconds))
    return table


_NAMES = (
    "r, pooled", "r by fold, mean, with neutral", "CCC", "mean absolute error", "spread ratio", "calibration error",
    "balanced accuracy of levels", "r within, less the SVM's", "r within, less joint speed's",
)  # fmt: skip


def _figures(protocol: ProtocolResult) -> list[str]:
    """The cells of `_NAMES`."""
    network = protocol.predictor(NETWORK)
    scores, folds = network.scores, [value for value in network.r_folds if value is not None]
    return [
        _interval(scores.r),
        _number(sum(folds) / len(folds) if folds else None),
        *map(_interval, (scores.ccc, scores.mae, scores.spread)),
        _number(protocol.reliability.error),
        _number(protocol.levels.balanced_accuracy),
        *map(_interval, (protocol.network_minus_baseline, protocol.network_minus_speed)),
    ]


def _invariance(result: Evaluation) -> Table:
    head = ["", "change", "largest", "r before", "after", "promised"]
    table = _table("The same movement seen otherwise: mean and largest change, r within", head)
    for change in result.changes:
        said = ("kept" if change.kept else "[bold red]BROKEN[/]") if change.promised else ""
        r = (_number(change.r_before), _number(change.r_after))
        table.add_row(change.title, f"{change.mean:.1e}", f"{change.most:.1e}", *r, said)
    return table


def _drift(result: Evaluation) -> Table:
    minutes = max((len(drift.minutes) for drift in result.drifts), default=0)
    table = _table(f"Drift over {minutes} minutes", ["memory", "slope a minute", "mean |difference|", "r by minute"])
    for drift in result.drifts:
        slope = f"{drift.slope:+.4f}"
        if drift.slope_low is not None and drift.slope_high is not None:
            slope += rf" \[{drift.slope_low:+.4f}, {drift.slope_high:+.4f}]"
        table.add_row(
            drift.memory, slope, f"{drift.apart:.4f}", " ".join(_number(minute.r) for minute in drift.minutes)
        )
    return table


def _found(protocol: ProtocolResult, name: str) -> PredictorResult | None:
    return next((predictor for predictor in protocol.predictors if predictor.name == name), None)


def _table(title: str, head: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 2, 0, 0), pad_edge=False)
    for index, name in enumerate(head):
        table.add_column(name, justify="right" if index else "left", no_wrap=True)
    return table


def _glanced(glance: Glance | None) -> str:
    return "-" if glance is None else _interval(glance.r_within)


def _interval(figure: Figure) -> str:
    """A number and, where it has one, its interval."""
    if figure.value is None:
        return "-"
    if figure.low is None or figure.high is None:
        return _number(figure.value)
    return rf"{_number(figure.value)} \[{_join((figure.low, figure.high))}]"


def _join(values: Iterable[float]) -> str:
    return ", ".join(_number(value).replace("0.", ".") for value in values)  # eighty columns are not many


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}".replace("-0.00", "0.00")
