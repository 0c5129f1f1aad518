"""The chart of a recording: intensity over time with the threshold, and ribbons of level, emotion and status."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fervor.cli.meter import threshold
from fervor.cli.picture.palette import LIGHT, between
from fervor.cli.picture.trace import Span, Trace, emotion_of, gaps, level_of, nearest, spans, status_of, stretches
from fervor.protocol.messages import Estimate

MOST_POINTS = 1500
"""Points of a drawn curve; of more, the lowest and highest of each slice are kept."""

LETTER = 0.075
"""Width of a letter of a ribbon's text, inches: enough for the widest words."""

LINE = 0.13
"""Height of a line of text, inches."""

LEAST = 0.03
"""Width that can still be seen, inches: that of a single frame."""

RIBBONS = ("level", "emotion", "status")


def draw_intensity(axes: Axes, trace: Trace, *, inches_per_second: float) -> None:
    """The curve, coloured by its level, over the threshold and its band."""
    curve = trace.curve
    _draw_threshold(axes, trace, curve)
    _draw_gaps(axes, gaps(curve), inches_per_second)
    kept = _points(curve)
    times = np.asarray([np.nan if one is None else one.t for one in kept])
    values = np.asarray([np.nan if one is None or one.intensity is None else one.intensity for one in kept])
    for level, colour in (("weak", LIGHT.weak), ("strong", LIGHT.strong)):
        mine = np.asarray([one is not None and level_of(one) == level for one in kept])
        mine[1:] |= mine[:-1]  # a colour reaches up to where the next begins
        axes.fill_between(times, 0.0, values, where=list(mine), color=colour, alpha=0.28, linewidth=0)
    axes.plot(times, values, color=LIGHT.ink, linewidth=1.3, solid_joinstyle="round")
    lone = [(one[0].t, one[0].intensity) for one in stretches(curve) if len(one) == 1]  # a line of one can't be seen
    axes.plot(*np.asarray(lone, float).reshape(-1, 2).T, ".", color=LIGHT.ink, markersize=4)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.set_ylabel("intensity")


def draw_moments(axes: Axes, trace: Trace, frames: Sequence[int]) -> None:
    """Where on the curve the drawn poses are."""
    for frame in frames:
        estimate = nearest(trace, float(trace.times[frame]))
        if estimate.intensity is not None:
            axes.axvline(estimate.t, color=LIGHT.rule, linewidth=0.7, zorder=0.5)
            axes.plot(
                [estimate.t],
                [estimate.intensity],
                marker="o",
                markersize=4.6,
                markerfacecolor=between(LIGHT.weak, LIGHT.strong, estimate.intensity),
                markeredgecolor=LIGHT.paper,
                markeredgewidth=0.8,
                zorder=4,
                clip_on=False,
            )


def draw_ribbons(axes: Axes, trace: Trace, *, inches_per_second: float) -> None:
    """Level, emotion and status as ribbons of text; a legend tells what has no room for its words."""
    curve = trace.curve
    said = zip(RIBBONS, (level_of, emotion_of, status_of), strict=True)
    for row, (kind, of) in enumerate(said):
        found = [*spans(curve, of), *(gaps(curve) if kind == "status" else ())]
        untold = _draw_ribbon(axes, kind, found, len(RIBBONS) - 1 - row, inches_per_second)
        if kind != "emotion":  # emotions have no colours of their own
            _add_to_legend(axes, kind, untold)
    axes.set_ylim(-0.08, len(RIBBONS))
    axes.set_yticks([len(RIBBONS) - 0.54 - row for row in range(len(RIBBONS))], RIBBONS)
    axes.tick_params(axis="y", length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("time, s", loc="left")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(
            loc="upper right", bbox_to_anchor=(1.0, -0.36), ncols=6, fontsize=7.5, frameon=False, handlelength=1.0,
            handleheight=0.9, columnspacing=1.2, borderaxespad=0.0, labelcolor=LIGHT.quiet,
        )  # fmt: skip


def _add_to_legend(axes: Axes, kind: str, texts: Sequence[str]) -> None:
    """Say what the colours mean of spans that don't say it themselves; a colour once, with all it stands for."""
    meanings: dict[str, dict[str, None]] = {}
    for text in texts:
        meanings.setdefault(_colour(kind, text), {}).update(dict.fromkeys(text.split(", ")))
    for colour, words in meanings.items():
        told = [word for word in words if colour != LIGHT.odd or word not in ("ok", "warming up")]
        if colour != LIGHT.paper:
            axes.bar([np.nan], [0.0], color=colour, alpha=_alpha(colour), label=", ".join(told))


def _draw_threshold(axes: Axes, trace: Trace, curve: Sequence[Estimate]) -> None:
    """From where on an intensity is strong: the threshold of the emotion in force."""
    labels = spans(curve, emotion_of)
    marks = np.asarray([threshold(trace.model, label.text) for label in labels])
    starts, ends = (np.asarray([getattr(label, side) for label in labels]) for side in ("start", "end"))
    if trace.hysteresis:
        times = np.stack([starts, ends, np.full(len(labels), np.nan)], axis=1).ravel()  # apart from one another
        low, high = (np.repeat(marks + sign * trace.hysteresis, 3) for sign in (-1, 1))
        axes.fill_between(times, low, high, color=LIGHT.ribbon, linewidth=0, zorder=0.2)
    axes.hlines(marks, starts, ends, color=LIGHT.quiet, linewidth=0.9, linestyle=(0, (4, 2.5)), zorder=1.5)
    mark = float(marks[-1])
    band = f"\n± {trace.hysteresis:g}" if trace.hysteresis else ""
    text = f"strong from\n{mark:.2f}{band}"
    axes.annotate(
        text, (1.0, mark), (5, 0), xycoords="axes fraction", textcoords="offset points",
        va="center", fontsize=7.5, color=LIGHT.quiet, annotation_clip=False,
    )  # fmt: skip


def _draw_gaps(axes: Axes, found: Sequence[Span], inches_per_second: float) -> None:
    """Where no frame came; with its length, where there is room for a line of text."""
    ranges = [(gap.start, gap.end - gap.start) for gap in found]
    axes.broken_barh(ranges, (0.0, 1.0), facecolor=LIGHT.ribbon, edgecolor=LIGHT.rule, hatch="////", linewidth=0)
    for gap in found:
        if (gap.end - gap.start) * inches_per_second >= LINE:
            middle = (gap.start + gap.end) / 2
            axes.text(middle, 0.5, gap.text, rotation=90, ha="center", va="center", fontsize=7.5, color=LIGHT.quiet)


def _points(curve: Sequence[Estimate]) -> list[Estimate | None]:
    """The estimates to draw, with None where the line breaks."""
    drawn: list[Estimate | None] = []
    kept = set(thinned([one.intensity for one in curve], MOST_POINTS))
    place = 0
    for stretch in stretches(curve):
        ends = (place, place + len(stretch) - 1)
        drawn += [one for at, one in enumerate(stretch, start=place) if at in kept or at in ends]
        drawn.append(None)
        place += len(stretch)
    return drawn[:-1]


def thinned(values: Sequence[float | None], most: int) -> list[int]:
    """Which of many values to draw: the first, lowest, highest and last of each of `most` / 4 slices."""
    if len(values) <= most:
        return list(range(len(values)))
    numbers = np.asarray([np.nan if value is None else value for value in values], float)
    kept: set[int] = set()
    for part in np.array_split(np.arange(len(values)), most // 4):
        kept |= {int(part[0]), int(part[-1])}
        if not np.isnan(numbers[part]).all():
            kept |= {int(part[np.nanargmin(numbers[part])]), int(part[np.nanargmax(numbers[part])])}
    return sorted(kept)


def _colour(kind: str, text: str) -> str:
    if kind == "level":
        return LIGHT.strong if text == "strong" else LIGHT.weak
    if kind == "emotion" or text == "ok":
        return LIGHT.ribbon
    if text.startswith("gap"):
        return LIGHT.paper
    return LIGHT.rule if text == "warming up" else LIGHT.odd


def _alpha(colour: str) -> float:
    return 0.6 if colour in (LIGHT.weak, LIGHT.strong, LIGHT.odd) else 1.0


def _draw_ribbon(axes: Axes, kind: str, found: Sequence[Span], place: int, inches_per_second: float) -> list[str]:
    """Draw the spans of one ribbon, colour by colour; gives the texts that found no room in their span."""
    by_colour: dict[str, list[tuple[float, float]]] = {}
    untold = []
    for span in found:
        width = max(span.end - span.start, LEAST / inches_per_second)
        colour = _colour(kind, span.text)
        by_colour.setdefault(colour, []).append((span.start, width))
        if len(span.text) * LETTER + 0.05 > width * inches_per_second:
            untold.append(span.text)
            continue
        box = {"boxstyle": "square,pad=0.1", "facecolor": LIGHT.paper, "linewidth": 0}
        axes.text(
            span.start + width / 2, place + 0.44, span.text, ha="center", va="center", fontsize=7.5, color=LIGHT.ink,
            bbox=box if colour == LIGHT.paper else None, zorder=4,
        )  # fmt: skip
    for colour, ranges in by_colour.items():
        look: dict[str, Any] = {"edgecolor": LIGHT.paper, "linewidth": 0.5}
        if colour == LIGHT.paper:
            look = {"edgecolor": LIGHT.rule, "linewidth": 0.0, "hatch": "////"}
        if colour == LIGHT.odd:  # short ones must not be covered
            look |= {"linewidth": 0.0, "zorder": 2}
        axes.broken_barh(ranges, (place + 0.06, 0.8), facecolor=colour, alpha=_alpha(colour), **look)
    return untold
