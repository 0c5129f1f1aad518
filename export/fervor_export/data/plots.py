"""Plots of a data set, as SVG; drawn without a screen, and the same for the same data."""

import io
from collections import Counter
from collections.abc import Callable, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from fervor.emotions import EMOTIONS
from fervor_export.clip import Clip
from fervor_export.data.dataset import Dataset
from fervor_export.data.label import NEUTRAL

_INK = "#3b5b92"

MOST_ACTORS = 40
"""Actors that are shown one by one."""


def plots(data: Dataset) -> dict[str, str]:
    """Plots by their titles; those that the data give."""
    clips = data.clips
    if not clips:
        return {}
    with mpl.rc_context({"svg.hashsalt": "fervor", "svg.fonttype": "none", "font.size": 9}):
        drawn = {"Clips by emotion and actor": _drawn(_table, clips, height=3.6)}
        if data.intense:
            drawn["Intensity by emotion"] = _drawn(_spread, data.intense)
            drawn["Intensities"] = _drawn(_shares, data.intense)
        if any(clip.observers for clip in clips):
            drawn["Observers of a clip"] = _drawn(_observers, clips)
        drawn["Length of clips"] = _drawn(_lengths, clips)
    return drawn


def _drawn(draw: Callable[[Axes, Sequence[Clip]], None], clips: Sequence[Clip], *, height: float = 2.8) -> str:
    figure = Figure(figsize=(7.2, height), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.subplots()
    axes.spines[["top", "right"]].set_visible(False)
    draw(axes, clips)
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()


def _table(axes: Axes, clips: Sequence[Clip]) -> None:
    """Counts of clips: an empty square is an emotion that an actor never shows."""
    actors = sorted({clip.actor for clip in clips})[:MOST_ACTORS]
    emotions = [emotion for emotion in EMOTIONS if any(clip.emotion == emotion for clip in clips)]
    counts = Counter((clip.emotion, clip.actor) for clip in clips)
    table = np.array([[counts[emotion, actor] for actor in actors] for emotion in emotions])
    axes.imshow(table, cmap="Blues", aspect="auto", vmin=0)
    axes.set_xticks(range(len(actors)), actors, rotation=90)
    axes.set_yticks(range(len(emotions)), emotions)
    if len(actors) <= 12:
        for row, column in np.ndindex(table.shape):
            dark = table[row, column] > table.max() / 2
            axes.text(column, row, str(table[row, column]), ha="center", va="center", color="w" if dark else "k")


def _spread(axes: Axes, clips: Sequence[Clip]) -> None:
    emotions = [emotion for emotion in EMOTIONS if any(clip.emotion == emotion for clip in clips)]
    shares = [[clip.intensity for clip in clips if clip.emotion == emotion] for emotion in emotions]
    axes.boxplot(shares, showmeans=True, medianprops={"color": _INK})
    axes.set_xticks(
        range(1, len(emotions) + 1), [f"{name}\n{len(mine)}" for name, mine in zip(emotions, shares, strict=True)]
    )
    axes.set_ylim(-0.02, 1.02)
    axes.set_ylabel("intensity")


def _shares(axes: Axes, clips: Sequence[Clip]) -> None:
    axes.hist(
        [clip.intensity for clip in clips], bins=list(np.linspace(-1 / 22, 1 + 1 / 22, 13)), color=_INK, rwidth=0.9
    )
    axes.set_xlabel(f"intensity, all clips but {NEUTRAL} ones")
    axes.set_ylabel("clips")


def _observers(axes: Axes, clips: Sequence[Clip]) -> None:
    counts = sorted(Counter(clip.observers for clip in clips if clip.observers).items())
    axes.bar([str(observers) for observers, _ in counts], [count for _, count in counts], color=_INK)
    axes.set_xlabel("observers")
    axes.set_ylabel("clips")


def _lengths(axes: Axes, clips: Sequence[Clip]) -> None:
    axes.hist([clip.seconds for clip in clips], bins=30, color=_INK, rwidth=0.9)
    axes.set_xlabel("seconds")
    axes.set_ylabel("clips")
