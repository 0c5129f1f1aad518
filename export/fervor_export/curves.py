"""The course of a training, drawn: errors of every epoch, and what validation actors say."""

import io
from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

from fervor_export.evaluation.plots import BLUE, GREEN, GREY, ORANGE, STYLE
from fervor_export.trainer import Epoch


def curves(history: Sequence[Epoch], *, kept: int) -> str:
    """Two plots side by side as SVG: the same for the same epochs.

    Args:
        history: the epochs.
        kept: number of the epoch whose weights were kept; marked.
    """
    number = [epoch.number for epoch in history]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.6, 3.4), layout="constrained")
        errors, agreement = figure.subplots(1, 2)
        errors.plot(number, [epoch.loss for epoch in history], color=GREY, label="loss")
        errors.plot(number, [epoch.train_mae for epoch in history], color=BLUE, label="mean absolute error, training")
        judged = [(epoch.number, epoch.validation) for epoch in history if epoch.validation is not None]
        at = [place for place, _ in judged]
        if judged:
            label = "mean absolute error, validation"
            errors.plot(at, [scores.mae for _, scores in judged], color=ORANGE, label=label)
        for name, title, colour in (("r", "r", GREY), ("r_within", "r within emotion", BLUE), ("ccc", "CCC", GREEN)):
            agreement.plot(at, [getattr(scores, name) for _, scores in judged], color=colour, label=title)
        for axes, title in ((errors, "loss and error"), (agreement, "agreement on validation actors")):
            axes.axvline(kept, color=GREY, linewidth=0.8, linestyle=":")
            axes.set(title=title, xlabel="epoch (dotted: kept)")
            axes.set_xlim(min(number) - 0.5, max(number) + 0.5)
            axes.locator_params(axis="x", integer=True)
        errors.set_ylim(bottom=0.0)
        errors.legend()
        if judged:
            agreement.legend()
        else:
            agreement.text(0.5, 0.5, "none: every actor is learned from", transform=agreement.transAxes, ha="center")
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()
