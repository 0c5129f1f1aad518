"""The chart of a recording: intensity over time with the threshold, and ribbons of level, emotion and status."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from fervor.cli.meter import threshold
from fervor.cli.picture.palette import LIGHT, between
from fervor.cli.picture.trace import Span, Trace, emotion_of, gaps, level_of, spans, status_of, stretches
from fervor.protocol.messages import Estimate

MOST_POINTS = 1500
"""Points of a drawn curve; of more, the lowest and highest of each slice are kept."""

LETTER = 0.075
"""Width of a letter of a ribbon's text, inches: enough for the widest words."""

RIBBONS = ("level", "emotion", "status")


def draw_intensity(axes: Axes, trace: Trace) -> None:
    """The curve, coloured by its level, over the threshold and its band."""
    curve = trace.curve
    _draw_threshold(axes, trace, curve)
    for gap in gaps(curve):
        axes.axvspan(gap.start, gap.end, facecolor=LIGHT.ribbon, edgecolor=LIGHT.rule, hatch="////", linewidth=0)
        middle = (gap.start + gap.end) / 2
        axes.text(middle, 0.5, gap.text, rotation=90, ha="center", va="center", fontsize=7.5, color=LIGHT.quiet)
    for stretch in stretches(curve):
        for level, colour in (("weak", LIGHT.weak), ("strong", LIGHT.strong)):
            times, values, mine = _points(stretch, level)
            axes.fill_between(times, 0.0, values, where=list(mine), color=colour, alpha=0.28, linewidth=0)
        times, values, _ = _points(stretch)
        axes.plot(times, values, color=LIGHT.ink, linewidth=1.3, solid_joinstyle="round")
        if len(stretch) == 1:  # a line of one point can't be seen
            axes.plot(times, values, color=LIGHT.ink, marker="o", markersize=3)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.set_ylabel("intensity")


def draw_moments(axes: Axes, trace: Trace, frames: Sequence[int]) -> None:
    """Where on the curve the drawn poses are."""
    curve = trace.curve
    times = np.asarray([estimate.t for estimate in curve])
    for frame in frames:
        estimate = curve[int(np.abs(times - trace.times[frame]).argmin())]
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
        place = len(RIBBONS) - 1 - row
        found = [*spans(curve, of), *(gaps(curve) if kind == "status" else ())]
        found.sort(key=lambda span: _colour(kind, span.text) == LIGHT.odd)  # short ones must not be covered
        roomy = [_draw_span(axes, span, place, _colour(kind, span.text), inches_per_second) for span in found]
        if kind != "emotion":  # emotions have no colours of their own
            _add_to_legend(axes, kind, [span.text for span, fits in zip(found, roomy, strict=True) if not fits])
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
    for label in labels:
        mark = threshold(trace.model, label.text)
        if trace.hysteresis:
            low, high = mark - trace.hysteresis, mark + trace.hysteresis
            axes.fill_between([label.start, label.end], low, high, color=LIGHT.ribbon, linewidth=0, zorder=0.2)
        axes.hlines(mark, label.start, label.end, color=LIGHT.quiet, linewidth=0.9, linestyle=(0, (4, 2.5)), zorder=1.5)
    mark = threshold(trace.model, labels[-1].text)
    band = f"\n± {trace.hysteresis:g}" if trace.hysteresis else ""
    text = f"strong from\n{mark:.2f}{band}"
    axes.annotate(
        text, (1.0, mark), (5, 0), xycoords="axes fraction", textcoords="offset points",
        va="center", fontsize=7.5, color=LIGHT.quiet, annotation_clip=False,
    )  # fmt: skip


def _points(
    stretch: Sequence[Estimate], level: str | None = None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Times and intensities [point] of a stretch, NaN without a pose, and where its level is `level` [point]."""
    kept = thinned([estimate.intensity for estimate in stretch], MOST_POINTS)
    times = np.asarray([stretch[at].t for at in kept])
    values = np.asarray([np.nan if stretch[at].intensity is None else stretch[at].intensity for at in kept], float)
    mine = np.asarray([str(stretch[at].level) == level for at in kept])
    mine[1:] |= mine[:-1]  # a colour reaches up to where the next begins
    return times, values, mine


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


def _draw_span(axes: Axes, span: Span, place: int, colour: str, inches_per_second: float) -> bool:
    """Draw one span; says whether its text found room."""
    least = 0.03 / inches_per_second  # a single frame must be seen too
    width = max(span.end - span.start, least)
    gap = colour == LIGHT.paper
    look: dict[str, Any] = {"edgecolor": LIGHT.paper, "linewidth": 0.7 if width > 2 * least else 0.0}
    if gap:
        look = {"edgecolor": LIGHT.rule, "linewidth": 0.0, "hatch": "////"}
    axes.broken_barh([(span.start, width)], (place + 0.06, 0.8), facecolor=colour, alpha=_alpha(colour), **look)
    roomy = len(span.text) * LETTER + 0.05 <= width * inches_per_second
    if roomy:
        box = {"boxstyle": "square,pad=0.1", "facecolor": LIGHT.paper, "linewidth": 0} if gap else None
        axes.text(
            span.start + width / 2, place + 0.44, span.text, ha="center", va="center", fontsize=7.5, color=LIGHT.ink,
            bbox=box,
        )  # fmt: skip
    return roomy
