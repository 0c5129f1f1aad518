"""Plots of a data set, as SVG; drawn without a screen, and the same for the same data."""

import io
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from fervor.emotions import EMOTIONS
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.standard_body import LIMBS, points
from fervor_export.clip import Clip
from fervor_export.data.dataset import Dataset, Take
from fervor_export.data.label import NEUTRAL

_INK = "#3b5b92"

MOST_SKELETONS = 4
"""Kinds of skeletons that are drawn."""

MOST_ACTORS = 40
"""Actors that are shown one by one."""


def plots(data: Dataset) -> dict[str, str]:
    """Plots by their titles; those that the data give."""
    clips = data.clips
    if not clips:
        return {}
    with mpl.rc_context({"svg.hashsalt": "fervor", "svg.fonttype": "path", "font.size": 9}):
        drawn = {"Clips by emotion and actor": _drawn(_table, clips, height=3.6)}
        if data.intense:
            drawn["Intensity by emotion"] = _drawn(_spread, data.intense)
            drawn["Intensities"] = _drawn(_shares, data.intense)
        if any(clip.observers for clip in clips):
            drawn["Observers of a clip"] = _drawn(_observers, clips)
        drawn["Length of clips"] = _drawn(_lengths, clips)
        if data.takes:
            drawn["Skeletons: a pose from the middle of a clip, on the rig"] = _poses(data.takes)
    return drawn


def _poses(takes: Sequence[Take]) -> str:
    """One body for each kind of skeleton, from the front and from its left: axes that are taken wrongly are seen."""
    kinds = {take.motion.skeleton: take for take in reversed(takes)}
    shown = dict(sorted(kinds.items())[:MOST_SKELETONS])
    figure = Figure(figsize=(7.2, 2.9 * len(shown)), layout="constrained")
    FigureCanvasSVG(figure)
    for row, (name, take) in zip(figure.subplots(len(shown), 2, squeeze=False), shown.items(), strict=True):
        rotations, mask = take.motion.phases[0]
        middle = len(rotations) // 2
        at = {point: place[0] for point, place in points(rotations[middle : middle + 1]).items()}
        for axes, (across, sign, title) in zip(
            row, ((0, 1.0, "from the front"), (2, -1.0, "from its left")), strict=True
        ):
            _draw_body(axes, {point: (sign * place[across], place[1]) for point, place in at.items()})
            axes.set_xlabel(title, fontsize=8)
        unseen = [joint for index, joint in enumerate(JOINTS) if not mask[:, index].any()]
        row[0].set_title(name, fontsize=8, loc="left")
        row[1].set_title(f"never seen: {', '.join(unseen)}" if unseen else "all 13 joints seen", fontsize=8, loc="left")
    return _svg(figure)


def _draw_body(axes: Axes, at: Mapping[str, tuple[float, float]]) -> None:
    """Bones between points in metres, the left ones orange."""
    for start, end in LIMBS:
        side = "#E69F00" if end.startswith("l_") else _INK
        (x, y), (u, v) = at[start], at[end]
        axes.plot([x, u], [y, v], color=side, linewidth=2, solid_capstyle="round", marker="o", ms=3)
    axes.set_aspect("equal")
    axes.set_xlim(-1.0, 1.0)
    axes.set_ylim(-1.0, 0.9)
    axes.set_xticks([])
    axes.set_ylabel("m")


def _drawn(draw: Callable[[Axes, Sequence[Clip]], None], clips: Sequence[Clip], *, height: float = 2.8) -> str:
    figure = Figure(figsize=(7.2, height), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.subplots()
    axes.spines[["top", "right"]].set_visible(False)
    draw(axes, clips)
    return _svg(figure)


def _svg(figure: Figure) -> str:
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
    axes.set_ylabel("intensity, share of observers")
    axes.set_xlabel("emotion, and how many clips; line: median, triangle: mean")


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
