"""Whether estimates stay sane over minutes: clips one after the other as one long stream, five minutes and more.

Between clips a body takes `BLEND_S` to move over, and the label is the next clip's. Every frame is compared with the
estimate of the same frame when its clip begins with a fresh state: what differs is what memory does, not what is shown.
`stateful` is the paper's, one state for ever; `staggered` is the service's default, states of `PERIOD_S`, half a period
apart, the older one speaking (docs, "A live body").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fervor.emotions import emotion_index
from fervor.rotations import slerp
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.evaluation.estimator import Estimates, Estimator, Motion
from fervor_export.evaluation.metrics import pearson, rounded

Floats = npt.NDArray[np.float64]
Memory = Literal["staggered", "stateful"]

MINUTES = 5
BLEND_S = 0.4
SETTLE_S = 1.0
"""At a clip's beginning a fresh state is still warming up: no comparison."""

PERIOD_S, FADE_S = 8.0, 0.5
"""The session's own, as a test holds."""

STREAMS = 4
"""Long streams of each estimator, at most so many in all of a protocol's folds together times this."""


@dataclass(frozen=True, slots=True)
class Minute:
    """One minute of all streams together."""

    p5: float
    p50: float
    p95: float
    """Percentiles of the estimates."""
    apart: float
    """Mean of estimate minus fresh estimate."""
    r: float | None
    """Pearson's, of the clips' mean estimates with their intensities."""


@dataclass(frozen=True, slots=True)
class Drift:
    """What one kind of memory does over minutes."""

    memory: Memory
    streams: int
    slope: float
    """Of estimate minus fresh estimate, per minute."""
    slope_low: float | None
    slope_high: float | None
    """Its 95 % interval over streams (normal); None for one stream."""
    apart: float
    """Mean absolute difference to the fresh estimate."""
    minutes: tuple[Minute, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LongStream:
    """Clips in a row."""

    motion: Motion
    label: npt.NDArray[np.intp]  # [frame] emotion
    clip: npt.NDArray[np.intp]  # [frame] which of `clips`; -1 between two
    age: npt.NDArray[np.intp]  # [frame] frames since its clip began
    clips: tuple[Clip, ...]


def drift(
    judged: Sequence[tuple[Estimator, Sequence[Clip]]], *, minutes: int = MINUTES, streams: int = STREAMS, seed: int = 0
) -> tuple[Drift, ...]:
    """Drift under both memories.

    Args:
        judged: estimators, each with clips that it has not learned from; clips come again where they are too few.
        minutes: length of a stream.
        streams: of each estimator.
        seed: of the order of the clips.
    """
    random = np.random.default_rng(seed)
    results: dict[Memory, list[tuple[Floats, Floats, LongStream]]] = {"staggered": [], "stateful": []}
    for estimator, clips in judged:
        if not clips:
            continue
        long = [concatenate(clips, minutes=minutes, random=random) for _ in range(streams)]
        fresh = _fresh(estimator, long)
        remembered = {"staggered": staggered(estimator, long), "stateful": _stateful(estimator, long)}
        for memory, estimates in remembered.items():
            results[memory] += list(zip(estimates, fresh, long, strict=True))  # type: ignore[index]
    return tuple(_summary(memory, parts, minutes) for memory, parts in results.items() if parts)


def concatenate(clips: Sequence[Clip], *, minutes: float, random: np.random.Generator) -> LongStream:
    """Clips in random order as one stream of so many minutes."""
    frames, steps = round(minutes * 60 * RATE_HZ), round(BLEND_S * RATE_HZ)
    share = np.linspace(0, 1, steps + 2, dtype=np.float32)[1:-1, None]
    parts: list[Motion] = []
    labels, which, ages, total = [], [], [], 0
    order: list[Clip] = []
    while total < frames:
        for index in random.permutation(len(clips)).tolist():
            clip = clips[index]
            if parts:
                parts.append(_way(parts[-1], clip, share))
                labels.append(np.full(steps, emotion_index(clip.emotion)))
                which.append(np.full(steps, -1))
                ages.append(np.zeros(steps, int))
            parts.append(Motion.of(clip))
            labels.append(np.full(clip.frames, emotion_index(clip.emotion)))
            which.append(np.full(clip.frames, len(order)))
            ages.append(np.arange(clip.frames))
            order.append(clip)
            total += clip.frames + steps
            if total >= frames + steps:
                break
    motion = Motion(
        np.concatenate([part.rotations for part in parts])[:frames],
        np.concatenate([part.mask for part in parts])[:frames],
    )
    label, clip_of, age = (np.concatenate(values)[:frames] for values in (labels, which, ages))
    return LongStream(motion, label, clip_of, age, tuple(order))


def staggered(estimator: Estimator, streams: Sequence[LongStream]) -> list[Floats]:
    """Estimates [frame] of streams under the service's default memory.

    A lane between two restarts is a sequence of its own from zero, so all lanes of all streams are run side by side.
    """
    half, fade = round(PERIOD_S * RATE_HZ / 2), round(FADE_S * RATE_HZ)
    pieces, places = [], []
    for row, stream in enumerate(streams):
        for start in range(0, len(stream.motion), half):
            stop = min(start + 2 * half, len(stream.motion))
            pieces.append(Motion(stream.motion.rotations[start:stop], stream.motion.mask[start:stop]))
            places.append((row, start, stop))
    mixed = [np.zeros(len(stream.motion)) for stream in streams]
    for (row, start, stop), estimates in zip(places, estimator.estimate(pieces), strict=True):
        weight = _lane_weight(start, stop - start, half, fade)
        own = np.take_along_axis(estimates, streams[row].label[start:stop, None], axis=1)[:, 0]
        mixed[row][start:stop] += weight * own
    return mixed


def _lane_weight(start: int, length: int, half: int, fade: int) -> Floats:
    """Share of a lane [frame] since its restart: it takes over at half a period and hands over at a whole one."""
    age = np.arange(length)
    rising = np.maximum(fade + 1 - (half - age), 0) / (fade + 1)
    falling = 1.0 - np.maximum(fade + 1 - (2 * half - age), 0) / (fade + 1)
    young = np.ones(length) if start == 0 else rising  # the first lane is alone
    return np.where(age < half, young, falling)


def _stateful(estimator: Estimator, streams: Sequence[LongStream]) -> list[Floats]:
    """Estimates [frame] of streams under one state for ever."""
    estimates = estimator.estimate([stream.motion for stream in streams])
    return [_own(values, stream.label) for values, stream in zip(estimates, streams, strict=True)]


def _fresh(estimator: Estimator, streams: Sequence[LongStream]) -> list[Floats]:
    """Estimates [frame] of every clip from a fresh state; nan between clips."""
    all_fresh = []
    for stream in streams:
        values = np.full(len(stream.motion), np.nan)
        for index, estimates in enumerate(estimator.estimate([Motion.of(clip) for clip in stream.clips])):
            here = np.flatnonzero(stream.clip == index)
            values[here] = _own(estimates[: len(here)], stream.label[here])
        all_fresh.append(values)
    return all_fresh


def _own(estimates: Estimates, label: npt.NDArray[np.intp]) -> Floats:
    """Estimates [frame] under each frame's label."""
    return np.take_along_axis(estimates, label[:, None], axis=1)[:, 0].astype(np.float64)


def _way(before: Motion, after: Clip, share: npt.NDArray[np.float32]) -> Motion:
    """From the end of one clip to the beginning of the next."""
    turned = slerp(before.rotations[-1:], after.rotations[:1], share)
    return Motion(turned, np.repeat((before.mask[-1] & after.mask[0])[None], len(share), 0))


def _summary(memory: Memory, parts: Sequence[tuple[Floats, Floats, LongStream]], minutes: int) -> Drift:
    slopes, apart = [], []
    for estimates, fresh, stream in parts:
        known = np.isfinite(fresh) & (stream.age >= round(SETTLE_S * RATE_HZ))
        time = np.flatnonzero(known) / (60.0 * RATE_HZ)
        off = (estimates - fresh)[known]
        apart.append(np.abs(off).mean() if len(off) else 0.0)
        slopes.append(float(np.polyfit(time, off, 1)[0]) if len(off) > 2 else 0.0)
    half = 1.96 * float(np.std(slopes, ddof=1)) / len(slopes) ** 0.5 if len(slopes) > 1 else None
    slope = float(np.mean(slopes))
    return Drift(
        memory=memory,
        streams=len(parts),
        slope=round(slope, 5) + 0.0,  # never -0
        slope_low=None if half is None else round(slope - half, 5),
        slope_high=None if half is None else round(slope + half, 5),
        apart=round(float(np.mean(apart)), 4),
        minutes=tuple(_minute(parts, minute) for minute in range(minutes)),
    )


def _minute(parts: Sequence[tuple[Floats, Floats, LongStream]], minute: int) -> Minute:
    span = slice(round(minute * 60 * RATE_HZ), round((minute + 1) * 60 * RATE_HZ))
    values = np.concatenate([estimates[span] for estimates, _, _ in parts])
    off = np.concatenate([(estimates - fresh)[span] for estimates, fresh, _ in parts])
    low, middle, high = np.percentile(values, (5, 50, 95))
    shown, true = [], []
    for estimates, _, stream in parts:
        here = stream.clip[span]
        for index in np.unique(here[here >= 0]).tolist():
            shown.append(float(estimates[span][here == index].mean()))
            true.append(stream.clips[index].intensity)
    return Minute(
        p5=round(float(low), 4),
        p50=round(float(middle), 4),
        p95=round(float(high), 4),
        apart=round(float(np.nanmean(off)) if np.isfinite(off).any() else 0.0, 4),
        r=rounded(pearson(np.asarray(shown), np.asarray(true))),
    )
