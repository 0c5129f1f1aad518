"""What a picture of a recording shows: estimates over time, runs of what stays the same, gaps. No drawing."""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, pairwise

import numpy as np
import numpy.typing as npt

from fervor.cli.meter import UNREMARKABLE
from fervor.protocol.messages import Estimate, ModelInfo
from fervor.session.timeline import INTERPOLATE_S

NOT_IN_ORDER = frozenset({"late", "duplicate"})
"""Flags of estimates that answer a frame out of its turn: they are no point of the curve."""


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time in which something stays the same; seconds, client clock."""

    start: float
    end: float
    text: str


@dataclass(frozen=True, eq=False)
class Trace:
    """One recording as far as it was estimated, of one body."""

    name: str
    model: ModelInfo
    estimates: Sequence[Estimate]
    times: npt.NDArray[np.float64]  # [frame] seconds, rising
    poses: npt.NDArray[np.float64]  # [frame, 13, 4] xyzw, NaN where not observed
    hysteresis: float | None = None
    """Half-width of the band in which a level stays; None where the model is elsewhere and did not say."""

    @cached_property
    def curve(self) -> list[Estimate]:
        """The estimates whose times rise."""
        kept: list[Estimate] = []
        for estimate in self.estimates:
            if NOT_IN_ORDER.isdisjoint(estimate.flags) and (not kept or estimate.t > kept[-1].t):
                kept.append(estimate)
        return kept

    @property
    def start_s(self) -> float:
        """Time of the first estimate, seconds."""
        return self.curve[0].t

    @property
    def end_s(self) -> float:
        """Time of the last estimate, seconds; later than the first, so that there is an axis."""
        return max(self.curve[-1].t, self.start_s + 1.0 / self.model.rate_hz)


def stretches(estimates: Sequence[Estimate]) -> Iterator[list[Estimate]]:
    """Estimates between two gaps; time rises."""
    begin = 0
    for place, (one, next_) in enumerate(pairwise(estimates), start=1):
        if next_.t - one.t > INTERPOLATE_S:
            yield list(estimates[begin:place])
            begin = place
    yield list(estimates[begin:])


def gaps(estimates: Sequence[Estimate]) -> list[Span]:
    """Where no frame came for longer than is interpolated."""
    between = pairwise(stretches(estimates))
    return [Span(one[-1].t, next_[0].t, f"gap {next_[0].t - one[-1].t:.1f} s") for one, next_ in between]


def runs(estimates: Sequence[Estimate], of: Callable[[Estimate], str]) -> Iterator[tuple[Span, list[Estimate]]]:
    """Runs of estimates of which the same is said; each ends where the next begins, or at a gap."""
    for stretch in stretches(estimates):
        found = [(text, list(run)) for text, run in groupby(stretch, of)]
        ends = [run[0].t for _, run in found[1:]] + [stretch[-1].t]
        for (text, run), end in zip(found, ends, strict=True):
            yield Span(run[0].t, end, text), run


def spans(estimates: Sequence[Estimate], of: Callable[[Estimate], str]) -> list[Span]:
    """When the same is said of estimates; what is said in no words is left out."""
    return [span for span, _ in runs(estimates, of) if span.text]


def level_of(estimate: Estimate) -> str:
    """`weak` or `strong`; nothing where there was no pose yet."""
    return str(estimate.level or "")


def emotion_of(estimate: Estimate) -> str:
    """The label in force."""
    return estimate.emotion


def status_of(estimate: Estimate) -> str:
    """Status and remarkable flags, in words: `warming up`, `ok`, `ok, jump`."""
    flags = (flag for flag in estimate.flags if flag not in UNREMARKABLE)
    return ", ".join(word.replace("_", " ") for word in (estimate.status, *flags))


def moments(trace: Trace, count: int) -> list[int]:
    """Frames to draw: in each of `count` equal slices of time the one nearest its middle; none in an empty slice."""
    width = (trace.end_s - trace.start_s) / count
    chosen: list[int] = []
    for middle in trace.start_s + width * (np.arange(count) + 0.5):
        if not len(trace.times):
            break
        frame = int(np.abs(trace.times - middle).argmin())
        if abs(trace.times[frame] - middle) <= width / 2 and frame not in chosen:
            chosen.append(frame)
    return chosen


def last_seen(poses: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Poses [frame, 13, 4] in which a joint that is not observed keeps its last rotation, at first that of standing.

    It is what the engine does with it (DESIGN: hold the last pose), so a picture shows what was estimated from.
    """
    unseen = np.isnan(poses).any(-1)  # [frame, joint]
    frames = np.arange(len(poses))[:, np.newaxis]
    latest = np.maximum.accumulate(np.where(unseen, -1, frames), axis=0)  # [frame, joint]
    held = np.take_along_axis(poses, np.maximum(latest, 0)[..., np.newaxis], axis=0)
    held[latest < 0] = (0.0, 0.0, 0.0, 1.0)
    return held


def nearest(trace: Trace, time: float) -> Estimate:
    """The estimate of the curve that is nearest to a time."""
    curve = trace.curve
    after = bisect_left(curve, time, key=lambda one: one.t)
    return min(curve[max(after - 1, 0) : after + 1], key=lambda one: abs(one.t - time))
