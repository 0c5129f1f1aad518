"""A picture of one recording: title, strip of poses, chart. Sizes in inches, so that bodies keep their proportions."""

import io
import re
import warnings
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from fervor.cli.meter import describe, is_demo
from fervor.cli.picture.chart import draw_intensity, draw_moments, draw_ribbons
from fervor.cli.picture.palette import LIGHT
from fervor.cli.picture.strip import HIGHEST_M, LOWEST_M, draw_strip
from fervor.cli.picture.trace import Trace
from fervor.scoring.scored import Scored, summarise

STYLE: dict[Any, Any] = {
    "font.size": 8.5,
    "text.color": LIGHT.ink,
    "axes.labelcolor": LIGHT.ink,
    "axes.edgecolor": LIGHT.rule,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": LIGHT.quiet,
    "ytick.color": LIGHT.quiet,
    "hatch.linewidth": 0.6,
    "hatch.color": LIGHT.rule,
    "svg.fonttype": "path",
    "svg.hashsalt": "fervor",
}
"""Quiet, and the same for the same numbers."""

WIDTH, LEFT, RIGHT = 9.6, 0.72, 0.78
TITLE, STRIP, CURVE, RIBBONS, BELOW = 0.56, 1.2, 1.55, 0.62, 0.46
SPACE = 0.07

BODIES = 12
"""Poses of a strip."""

LONGEST_NAME = 43
"""Letters of a name that stand in the title; of a longer one its ends do."""

MINUTES_FROM_S = 300.0
"""Duration from which on time is counted in minutes, seconds."""

DOTS_PER_INCH = 200


def image(trace: Trace, kind: str) -> bytes:
    """The picture as a file of kind `png` or `svg`."""
    return _saved(draw(trace), kind, facecolor=LIGHT.paper)


def svg(trace: Trace) -> str:
    """The picture as SVG for a page: without its title and a background."""
    return _saved(draw(trace, title=False), "svg", transparent=True).decode()


def draw(trace: Trace, *, title: bool = True) -> Figure:
    """The picture of a trace with at least one estimate."""
    top = TITLE if title else 0.0
    height = top + STRIP + SPACE + CURVE + SPACE + RIBBONS + BELOW
    with mpl.rc_context(STYLE):
        return _draw(trace, height, top)


def _draw(trace: Trace, height: float, top: float) -> Figure:
    figure = Figure(figsize=(WIDTH, height))
    wide = WIDTH - LEFT - RIGHT
    seconds = trace.end_s - trace.start_s

    def panel(above: float, high: float) -> Axes:
        axes = figure.add_axes((LEFT / WIDTH, 1.0 - (above + high) / height, wide / WIDTH, high / height))
        axes.set_xlim(trace.start_s, trace.end_s)
        return axes

    strip, curve = panel(top, STRIP), panel(top + STRIP + SPACE, CURVE)
    ribbons = panel(top + STRIP + SPACE + CURVE + SPACE, RIBBONS)
    seconds_per_metre = seconds / wide * STRIP / (HIGHEST_M - LOWEST_M)
    frames = draw_strip(strip, trace, count=BODIES, seconds_per_metre=seconds_per_metre)
    draw_intensity(curve, trace, inches_per_second=wide / seconds)
    draw_moments(curve, trace, frames)
    draw_ribbons(ribbons, trace, inches_per_second=wide / seconds)
    curve.tick_params(axis="x", labelbottom=False, length=0)
    _mark_time(ribbons, seconds)
    if top:
        _write_title(figure, trace, height)
    return figure


def _mark_time(axes: Axes, seconds: float) -> None:
    """Ticks that people count in: seconds, or minutes where a recording has many."""
    if seconds < MINUTES_FROM_S:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=10, steps=[1, 2, 3, 5, 6, 10]))
        return
    step = next((60.0 * minutes for minutes in (1, 2, 5, 10, 30) if seconds / 60 / minutes <= 12), 3600.0)
    axes.xaxis.set_major_locator(MultipleLocator(step * max(1, round(seconds / step / 12))))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda time, _: f"{time // 60:.0f}:{time % 60:02.0f}"))
    axes.set_xlabel("time, minutes:seconds", loc="left")


def facts(trace: Trace) -> str:
    """The recording in a few numbers, those of `fervor score`."""
    summary = summarise(Scored.of(trace.name, trace.estimates))
    if summary.mean is None or summary.peak is None:
        return f"{summary.frames} frames, no pose in any"
    return f"mean {summary.mean:.2f}, peak {summary.peak:.2f}, strong in {summary.strong:.0%} of the frames"


def _write_title(figure: Figure, trace: Trace, height: float) -> None:
    left, right = LEFT / WIDTH, 1.0 - RIGHT / WIDTH
    first, second = 1.0 - 0.24 / height, 1.0 - 0.44 / height
    name = trace.name if len(trace.name) <= LONGEST_NAME else f"{trace.name[:20]} … {trace.name[-20:]}"
    figure.text(left, first, name, fontsize=11, fontweight="bold", va="center", parse_math=False)
    figure.text(right, first, facts(trace), ha="right", va="center", color=LIGHT.quiet)
    colour = LIGHT.caution if is_demo(trace.model) else LIGHT.quiet
    figure.text(left, second, describe(trace.model), va="center", color=colour)


def _saved(figure: Figure, kind: str, **how: Any) -> bytes:
    metadata = {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
    out = io.BytesIO()
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a name in a script that the font lacks shows as boxes
        figure.savefig(out, format=kind, dpi=DOTS_PER_INCH, metadata=metadata, **how)
    return _rounded(out.getvalue()) if kind == "svg" else out.getvalue()


def _rounded(drawn: bytes) -> bytes:
    """SVG without the digits of paths that nobody can see: half the bytes."""
    return re.sub(rb' d="[^"]*"', lambda path: re.sub(rb"(\.\d\d)\d+", rb"\1", path[0]), drawn)
