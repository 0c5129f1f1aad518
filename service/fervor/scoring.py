"""Scores whole recordings: the estimates a stream of the same frames would get, to the bit.

Recordings are stepped side by side through an engine of their own, so that live sessions are never in the way.
"""

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.levels import Level
from fervor.model import Model
from fervor.protocol.messages import Estimate
from fervor.session.body import Body, Terms
from fervor.session.events import Pose, Ticket
from fervor.session.label import NO_LABEL, Label, make_label

MOST_TOGETHER = 64
"""Recordings stepped side by side."""


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """Frames of one body in the order of its source's joints."""

    name: str
    times: npt.NDArray[np.float64]  # [frame] seconds
    rotations: npt.NDArray[np.float64]  # [frame, joint, 4] xyzw
    observed: npt.NDArray[np.bool_]  # [frame, joint]
    emotion: str | Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True)
class Summary:
    """A scored recording in a few numbers; intensities over the frames after the warm-up, if there are any."""

    name: str
    emotion: str
    frames: int
    duration_s: float
    mean: float | None
    peak: float | None
    last: float | None
    strong: float
    """Share of the frames with level strong."""
    level: Level | None
    """At the end."""


class Scorer:
    """Scores recordings with one model. Thread-safe; blocks its caller."""

    def __init__(self, model: Model, *, row_multiple: int = 1) -> None:
        self._engine = Engine(model, capacity=MOST_TOGETHER, row_multiple=row_multiple)
        self._lock = threading.Lock()

    def score(
        self, takes: Sequence[Take], terms: Terms, *, progress: Callable[[int], None] | None = None
    ) -> list[list[Estimate]]:
        """The estimates of every frame of every take, in order.

        Args:
            takes: what to score.
            terms: as a live session would agree on them; the source is that of all takes.
            progress: called with the number of frames done since the last call.

        Raises:
            InputError: an emotion that is not known.
            EngineError: the model failed.
        """
        scored: list[list[Estimate]] = []
        for first in range(0, len(takes), MOST_TOGETHER):
            with self._lock:
                scored += self._side_by_side(takes[first : first + MOST_TOGETHER], terms, progress)
        return scored

    def _side_by_side(
        self, takes: Sequence[Take], terms: Terms, progress: Callable[[int], None] | None
    ) -> list[list[Estimate]]:
        # The engine is ours alone while we hold the lock, so a take's place is its slot.
        bodies = [Body(take.name, slot, terms, _label(take, terms)) for slot, take in enumerate(takes)]
        answers: list[list[Estimate]] = [[] for _ in takes]
        for frame in range(max((len(take.times) for take in takes), default=0)):
            batch = [(at, _plan(bodies[at], take, frame)) for at, take in enumerate(takes) if frame < len(take.times)]
            for (at, ticket), outcome in zip(batch, self._engine.run([ticket for _, ticket in batch]), strict=True):
                if isinstance(outcome, EngineError):
                    raise outcome
                answers[at].append(bodies[at].conclude(ticket, outcome))
            if progress:
                progress(len(batch))
        return answers


def summarise(name: str, estimates: Sequence[Estimate]) -> Summary:
    """A few numbers for one scored recording."""
    settled = list(_intensities(estimate for estimate in estimates if estimate.status == "ok"))
    settled = settled or list(_intensities(estimates))
    last = estimates[-1] if estimates else None
    return Summary(
        name=name,
        emotion=last.emotion if last else "unknown",
        frames=len(estimates),
        duration_s=estimates[-1].t - estimates[0].t if estimates else 0.0,
        mean=float(np.mean(settled)) if settled else None,
        peak=max(settled, default=None),
        last=last.intensity if last else None,
        strong=float(np.mean([estimate.level is Level.STRONG for estimate in estimates])) if estimates else 0.0,
        level=last.level if last else None,
    )


def _label(take: Take, terms: Terms) -> Label:
    if take.emotion is None:
        return NO_LABEL
    return make_label(take.emotion, float(take.times[0]) if len(take.times) else 0.0, terms.emotion_ttl_s)


def _plan(body: Body, take: Take, frame: int) -> Ticket:
    pose = Pose(take.rotations[frame], take.observed[frame])
    return body.plan(frame, float(take.times[frame]), pose)


def _intensities(estimates: Iterable[Estimate]) -> Iterator[float]:
    return (estimate.intensity for estimate in estimates if estimate.intensity is not None)
