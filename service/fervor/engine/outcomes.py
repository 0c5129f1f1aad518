"""What became of tickets, from arrays by ticket."""

from collections.abc import Sequence
from math import isnan

import numpy as np
import numpy.typing as npt

from fervor.engine.slots import Slots
from fervor.session.events import Outcome, Ticket


def outcomes_of(
    tickets: Sequence[Ticket],
    said: npt.NDArray[np.float64],
    seen: npt.NDArray[np.int64],
    jumped: Sequence[int],
    slots: Slots,
) -> list[Outcome]:
    """The outcome of each ticket, once the slots hold what it left.

    Args:
        tickets: the batch.
        said: [ticket, 1 + emotion] intensity, nan before the first step, and that under every emotion.
        seen: [ticket] upper-body joints observed.
        jumped: [ticket] joints that were rejected as jumps.
        slots: of the engine, for tickets with a checkpoint.
    """
    columns = zip(tickets, said[:, 0].tolist(), said[:, 1:], seen.tolist(), jumped, strict=True)
    return [
        Outcome(
            None if isnan(intensity) else intensity,
            by_emotion,
            joints,
            jumps,
            None if ticket.checkpoint is None else slots.recall(ticket.slot),
        )
        for ticket, intensity, by_emotion, joints, jumps in columns
    ]
