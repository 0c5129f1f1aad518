"""Plots of the report, as SVG text. Colours are safe for the colour-blind (Okabe & Ito)."""

import io
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from fervor_pepper.study.answers import LEAST, MOST
from fervor_pepper.study.result import ScaleResult

BLUE, GREY = "#0072B2", "#8A8A8A"

STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "fervor",
}
"""Quiet, and the same for the same numbers."""


def ratings(result: ScaleResult, *, width: float = 4.2, height: float = 3.2) -> str:
    """One scale: everybody's ratings in grey, means with their intervals on top; sizes in inches."""
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(width, height), layout="constrained")
        axes = canvas.subplots()
        places = np.arange(len(result.conditions))
        # Whole numbers lie on each other; each participant keeps one shift in all conditions.
        shifts = np.random.default_rng(0).uniform(-0.09, 0.09, (len(result.participants), 2))
        for row, (across, up) in zip(result.scores, shifts, strict=True):
            axes.plot(places + across, np.asarray(row) + up, color=GREY, lw=0.6, alpha=0.45, marker="o", ms=2.6)
        means = np.asarray([condition.mean for condition in result.conditions])
        low = means - [condition.low for condition in result.conditions]
        high = np.asarray([condition.high for condition in result.conditions]) - means
        axes.errorbar(places, means, [low, high], color=BLUE, marker="o", ms=6, capsize=4, lw=1.8, zorder=3)
        axes.set_xticks(places, [condition.name for condition in result.conditions])
        axes.set_xlim(-0.4, len(places) - 0.6)
        axes.set_ylim(LEAST - 0.3, MOST + 0.3)
        axes.set_yticks(range(LEAST, MOST + 1))
        axes.set_ylabel(f"{result.scale} ({LEAST} to {MOST})")
        out = io.StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()
