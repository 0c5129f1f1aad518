"""Plots of the report, as SVG text. Colours are safe for the colour-blind (Okabe & Ito), every axis says its unit."""

import io
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from fervor.emotions import EMOTIONS
from fervor_export.clip import Clip
from fervor_export.evaluation.drift import Drift
from fervor_export.evaluation.metrics import Figure
from fervor_export.evaluation.protocols import BASELINE, NETWORK, Run
from fervor_export.evaluation.result import ProtocolResult
from fervor_export.evaluation.thresholds import Levels

BLUE, ORANGE, GREEN, GREY, RED = "#0072B2", "#E69F00", "#009E73", "#8A8A8A", "#D55E00"

STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "fervor",
}
"""Quiet, and the same for the same numbers."""


def svg(draw: Callable[[Axes], None], *, width: float = 5.4, height: float = 3.6) -> str:
    """One plot; sizes in inches."""
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(width, height), layout="constrained")
        draw(canvas.subplots())
        out = io.StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()


def scatter(run: Run) -> Callable[[Axes], None]:
    """Predictions and intensities of all clips, neutral apart."""

    def draw(axes: Axes) -> None:
        target = np.asarray([clip.intensity for clip in run.clips])
        neutral = np.asarray([clip.emotion == "neutral" for clip in run.clips])
        jitter = np.random.default_rng(0).uniform(-0.012, 0.012, len(target))  # shares of eleven lie on each other
        size = float(np.clip(3000 / max(len(target), 1), 5, 22))
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
        for mine, colour, name in ((~neutral, BLUE, "all but neutral"), (neutral, GREY, "neutral")):
            if mine.any():
                x, y = (target + jitter)[mine], run.predictions[NETWORK][mine]
                label = f"{name} (n = {mine.sum()})"
                axes.scatter(x, y, s=size, color=colour, alpha=0.45, linewidths=0, label=label)
        _unit_square(axes, "intensity (share of observers)", "prediction, not learned from")
        axes.legend(loc="upper left", fontsize=8)

    return draw


def by_emotion(protocol: ProtocolResult, clips: Sequence[Clip]) -> Callable[[Axes], None]:
    """Correlation within each emotion, network beside baseline, with intervals and ceilings."""
    counts = Counter(clip.emotion for clip in clips)

    def draw(axes: Axes) -> None:
        names = [emotion for emotion in EMOTIONS if emotion in protocol.predictor(NETWORK).scores.emotions]
        names.sort(key=lambda emotion: emotion == "neutral")
        for offset, name, colour, label in ((-0.19, NETWORK, BLUE, "network"), (0.19, BASELINE, ORANGE, "baseline")):
            figures = [protocol.predictor(name).scores.emotions[emotion] for emotion in names]
            _bars(axes, np.arange(len(names)) + offset, figures, colour, label)
        for place, emotion in enumerate(names):
            most = protocol.ceilings.emotions.get(emotion)
            if most is not None:
                name = "noise ceiling" if place == 0 else "_"
                axes.hlines(most, place - 0.42, place + 0.42, color=RED, linewidth=1.4, label=name)
        axes.axhline(0, color="black", linewidth=0.6)
        shown = [f"({name}) {counts[name]}" if name == "neutral" else f"{name} {counts[name]}" for name in names]
        axes.set_xticks(range(len(names)), shown, rotation=35, ha="right")
        axes.set_xlabel("emotion, and how many clips")
        axes.set_ylabel("r within the emotion")
        axes.set_ylim(*_around(axes.get_ylim()))
        if axes.get_legend_handles_labels()[1]:
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8)

    return draw


def calibration(protocol: ProtocolResult) -> Callable[[Axes], None]:
    """Mean intensity of clips by their prediction."""

    def draw(axes: Axes) -> None:
        bins = protocol.reliability.bins
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
        x, y = [entry.predicted for entry in bins], [entry.observed for entry in bins]
        axes.plot(x, y, color=BLUE, linewidth=1)
        most = max((entry.clips for entry in bins), default=1)
        axes.scatter(x, y, s=[14 + 130 * entry.clips / most for entry in bins], color=BLUE, zorder=3)
        for entry in bins:
            place = (entry.predicted, entry.observed)
            axes.annotate(str(entry.clips), place, (7, -11), textcoords="offset points", fontsize=7, color="#444444")
        _unit_square(axes, "mean prediction", "mean intensity")

    return draw


def by_seconds(protocol: ProtocolResult) -> Callable[[Axes], None]:
    """Correlation by seconds seen."""

    def draw(axes: Axes) -> None:
        glances = protocol.seconds
        places = [glance.seconds or len(glances) + 0.5 for glance in glances]
        for colour, label, figures in (
            (BLUE, "within emotion", [glance.r_within for glance in glances]),
            (GREEN, "pooled", [glance.r for glance in glances]),
        ):
            known = [(place, figure) for place, figure in zip(places, figures, strict=True) if figure.value is not None]
            if not known:
                continue
            x = [place for place, _ in known]
            axes.plot(x, [figure.value or 0.0 for _, figure in known], color=colour, marker="o", ms=3.5, label=label)
            axes.fill_between(x, *_band([figure for _, figure in known]), color=colour, alpha=0.13, linewidth=0)
        axes.axhline(0, color="black", linewidth=0.6)
        axes.set_xticks(places, [f"{glance.seconds:g}" if glance.seconds else "whole" for glance in glances])
        axes.set_xlabel("seconds of the clip seen")
        axes.set_ylabel("r")
        axes.set_ylim(*_around(axes.get_ylim()))
        if axes.get_legend_handles_labels()[1]:
            axes.legend(loc="lower right", fontsize=8)

    return draw


def over_minutes(drifts: Sequence[Drift]) -> Callable[[Axes], None]:
    """Estimates minute by minute, by memory."""

    def draw(axes: Axes) -> None:
        colours = {"staggered": BLUE, "stateful": ORANGE}
        for offset, drift in zip((-0.09, 0.09), drifts, strict=False):
            x = np.arange(1, len(drift.minutes) + 1) + offset
            middle = np.asarray([minute.p50 for minute in drift.minutes])
            low = middle - [minute.p5 for minute in drift.minutes]
            high = np.asarray([minute.p95 for minute in drift.minutes]) - middle
            label = f"{drift.memory} (slope {drift.slope + 0.0:+.4f} a minute)"
            axes.errorbar(
                x, middle, [low, high], color=colours[drift.memory], marker="o", ms=4, capsize=3, lw=1.2, label=label
            )
        most = max(len(drift.minutes) for drift in drifts)
        axes.set_xticks(range(1, most + 1))
        axes.set_xlabel("minute of the stream")
        axes.set_ylabel("estimate: median, 5 to 95 %")
        axes.set_ylim(0, 1)
        axes.legend(loc="upper left", fontsize=8)

    return draw


def confusion(levels: Levels) -> Callable[[Axes], None]:
    """True and told levels."""

    def draw(axes: Axes) -> None:
        counts = np.asarray(
            [
                [levels.all.weak_as_weak, levels.all.weak_as_strong],
                [levels.all.strong_as_weak, levels.all.strong_as_strong],
            ]
        )
        shares = counts / np.maximum(counts.sum(1, keepdims=True), 1)
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
        for row in range(2):
            for column in range(2):
                colour = "white" if shares[row, column] > 0.6 else "black"
                text = f"{counts[row, column]}\n{shares[row, column]:.0%}"
                axes.text(column, row, text, ha="center", va="center", color=colour)
        axes.set_xticks([0, 1], ["weak", "strong"])
        axes.set_yticks([0, 1], ["weak", "strong"])
        axes.set_xlabel("told")
        axes.set_ylabel("true")
        axes.spines[:].set_visible(False)

    return draw


def actors(counts: Mapping[str, int], *, most: int = 24) -> Callable[[Axes], None]:
    """Clips of each actor; of many only the first and the last."""

    def draw(axes: Axes) -> None:
        ordered = sorted(counts.items(), key=lambda entry: -entry[1])
        if len(ordered) > most:
            ordered = [*ordered[: most // 2], *ordered[-most // 2 :]]
        axes.bar(range(len(ordered)), [count for _, count in ordered], color=GREY)
        axes.set_xticks(range(len(ordered)), [name for name, _ in ordered], rotation=60, ha="right", fontsize=7)
        axes.set_ylabel("clips")

    return draw


def _bars(axes: Axes, places: npt.NDArray[Any], figures: Sequence[Figure], colour: str, label: str) -> None:
    """Bars with intervals; nothing where a figure is not defined."""
    known = [(place, figure) for place, figure in zip(places, figures, strict=True) if figure.value is not None]
    values = [figure.value or 0.0 for _, figure in known]
    low, high = _band([figure for _, figure in known])
    off = [np.maximum(np.subtract(values, low), 0), np.maximum(np.subtract(high, values), 0)]
    x = [place for place, _ in known]
    axes.bar(x, values, 0.36, color=colour, label=label)
    axes.errorbar(x, values, off, fmt="none", ecolor="#333333", elinewidth=0.8, capsize=1.5)


def _band(figures: Sequence[Figure]) -> tuple[list[float], list[float]]:
    """Ends of intervals; the value itself where there is none."""
    value = [figure.value or 0.0 for figure in figures]
    low = [figure.low if figure.low is not None else at for figure, at in zip(figures, value, strict=True)]
    high = [figure.high if figure.high is not None else at for figure, at in zip(figures, value, strict=True)]
    return low, high


def _around(limits: tuple[float, float]) -> tuple[float, float]:
    """Limits that show zero, and no more than correlations can be."""
    return max(-1.0, min(limits[0], -0.05)), min(1.0, max(limits[1], 0.5))


def _unit_square(axes: Axes, x: str, y: str) -> None:
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.set_aspect("equal")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
