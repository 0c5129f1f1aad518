"""Recordings that repeat each other under two names: copied, mirrored, cut, another phase, smoothed, with noise added.

A data set that holds them leaks, however it is split by name. Compared are windows of `SPAN` of smoothed movement, less
the window's mean pose, so that noise averages out. Two windows are the same movement where they differ by less than
`RATIO` of how much they move, and their mean poses are near. Two recordings count as one where most of the moving
windows of the shorter one are found in the other, in order and at one lag. People never repeat a movement that closely;
only who walks on and on at one pace comes near.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

from fervor.rotations import to_rotvec
from fervor.skeletons.rig import UPPER_BODY, mirror_pose
from fervor_export.clip import Clip

Floats = npt.NDArray[np.float32]

WIDTH = 3 * len(UPPER_BODY)
"""Numbers of a pose: rotation vectors of the upper body."""

SMOOTHED = 9
"""Frames of the moving mean: 0.3 s."""

STEP, STEPS = 8, 4
"""A window is so many smoothed poses, so many frames apart."""

SPAN = STEP * (STEPS - 1) + 1
"""Frames that a window covers: 0.8 s."""

RATIO = 0.25
"""Of how much a window moves, by which the same movement may differ. Unrelated movement differs by more than all of it;
noise of 5° on every angle of a 120 Hz file by less, where people gesture."""

NEAR_RAD = 0.45
"""Root of the summed squares over joints by which mean poses may differ: 26°, for sensors mounted a little askew."""

MOVING_RAD = 0.12
"""Norm of a window below which it stands still, and is no evidence."""

KEPT_EVERY, ASKED_EVERY = 1, 6
"""Frames between windows that are looked through, and between those looked for: what is quick is another a frame on."""

SHARE, LEAST = 0.6, 2
"""Of a recording's moving windows, and how many, must be found again."""

LAG_SLACK = 4
"""Frames by which a lag may waver: a clock may run 5 % fast."""

DIMENSIONS = 40
"""In which candidates are looked for; distances are never longer there, so nothing is missed."""

ROUNDING = 1e-4
"""Of float32 products."""

TOGETHER = 512
"""Windows looked for at once: bounds memory."""


@dataclass(frozen=True, slots=True, eq=False)
class _Windows:
    """Moving windows of clips."""

    values: Floats  # [window, 4 · 27] rad, less the mean pose
    mean: Floats  # [window, 27] rad
    length: Floats  # [window] norms
    clip: npt.NDArray[np.int64]  # [window]
    frame: npt.NDArray[np.int64]  # [window] where it begins

    @property
    def directions(self) -> Floats:
        """Of length one."""
        return self.values / self.length[:, None]


def groups(clips: Sequence[Clip]) -> dict[str, str]:
    """Recordings that repeat another one, each with the name of the first of its kind, itself included.

    Clips that share a name are one recording already.
    """
    leader = {clip.name: clip.name for clip in clips}
    for a, b in _pairs(clips):
        first, second = sorted(_root(leader, clips[index].name) for index in (a, b))
        leader[second] = first
    roots = {name: _root(leader, name) for name in leader}
    sizes = Counter(roots.values())
    return {name: root for name, root in roots.items() if sizes[root] > 1}


def _pairs(clips: Sequence[Clip]) -> list[tuple[int, int]]:
    """Pairs of clips of which one repeats the other, in order."""
    plain = [_smoothed(clip) for clip in clips]
    kept = _windows(plain, KEPT_EVERY)
    found = set()
    for poses in (plain, [_smoothed(clip, mirror=True) for clip in clips]):
        asked = _windows(poses, ASKED_EVERY)
        votes: Counter[tuple[int, int, int]] = Counter()
        for here, there in _alike(asked, kept):
            votes.update(_votes(asked, kept, here, there))
        counts = np.bincount(asked.clip, minlength=len(clips))
        found |= {
            (min(mine, other), max(mine, other))
            for (mine, other, _), count in votes.items()
            if count >= max(LEAST, SHARE * counts[mine])
        }
    return sorted(found)


def _votes(asked: _Windows, kept: _Windows, here: Any, there: Any) -> set[tuple[int, int, int]]:
    """Who is asked about, in whom it was found, and lags that this speaks for; `here` is one window's place."""
    mine, others = int(asked.clip[here]), kept.clip[there]
    lags = kept.frame[there] - asked.frame[here]
    return {
        (mine, other, lag + slack)
        for other, lag in zip(others.tolist(), lags.tolist(), strict=True)
        if other != mine
        for slack in range(-LAG_SLACK, LAG_SLACK + 1)
    }


def _alike(asked: _Windows, kept: _Windows) -> Iterator[tuple[int, npt.NDArray[np.intp]]]:
    """For each window asked about the places of those that hold the same movement, where there are any.

    |a - b|² ≤ RATIO² |a| |b| implies |a/|a| - b/|b|| ≤ RATIO, and no projection makes that longer.
    """
    if not len(kept.values) or not len(asked.values):
        return
    axes = _main_axes(kept.directions)
    look, near = asked.directions @ axes, kept.directions @ axes
    ones = [np.ones((len(points), 1), np.float32) for points in (look, near)]
    half = [-0.5 * (points**2).sum(1, keepdims=True) for points in (look, near)]
    look, near = np.hstack([look, half[0], ones[0]]), np.hstack([near, ones[1], half[1]])  # product: -distance² / 2
    for start in range(0, len(look), TOGETHER):
        close = look[start : start + TOGETHER] @ near.T >= -0.5 * RATIO**2 - ROUNDING
        rows, columns = np.divmod(np.flatnonzero(close), len(near))  # many times faster than nonzero of two axes
        rows += start
        off = ((asked.values[rows] - kept.values[columns]) ** 2).sum(1)
        same = off <= RATIO**2 * asked.length[rows] * kept.length[columns]
        same &= ((asked.mean[rows] - kept.mean[columns]) ** 2).sum(1) <= NEAR_RAD**2
        places, first = np.unique(rows[same], return_index=True)
        parts = np.split(columns[same], first[1:])
        yield from zip(places.tolist(), parts, strict=False)  # of no places there is one part, an empty one


def _main_axes(directions: Floats) -> Floats:
    """The directions [4 · 27, axis] along which windows differ most."""
    _, axes = np.linalg.eigh(directions.T @ directions)
    main: Floats = axes[:, -DIMENSIONS:]
    return main


def _windows(poses: Sequence[Floats], every: int) -> _Windows:
    """Moving windows of clips' smoothed poses, one each so many frames."""
    values, means, owners, frames = (
        [np.empty((0, STEPS * WIDTH), np.float32)],
        [np.empty((0, WIDTH), np.float32)],
        [],
        [],
    )
    for index, series in enumerate(poses):
        begins = np.arange(0, max(len(series) - SPAN + 1, 0), every)
        whole = np.stack([series[begins + STEP * step] for step in range(STEPS)], axis=1)  # [window, 4, 27]
        mean = whole.mean(1)
        window = (whole - mean[:, None]).reshape(len(begins), STEPS * WIDTH)
        moving = np.linalg.norm(window, axis=1) > MOVING_RAD
        values.append(window[moving])
        means.append(mean[moving])
        owners += [index] * int(moving.sum())
        frames += begins[moving].tolist()
    stacked = np.concatenate(values)
    length = np.linalg.norm(stacked, axis=1)
    return _Windows(stacked, np.concatenate(means), length, np.array(owners, np.int64), np.array(frames, np.int64))


def _smoothed(clip: Clip, *, mirror: bool = False) -> Floats:
    """Upper bodies [frame, 27] as rotation vectors, smoothed over time and over the recording's phases."""
    phases = [(clip.rotations, clip.mask), *clip.phases]
    frames = min(len(rotations) for rotations, _ in phases)
    upper, total = list(UPPER_BODY), np.zeros((frames, WIDTH))
    for rotations, mask in phases:
        turned, seen = rotations[:frames], mask[:frames]
        if mirror:
            turned, seen = mirror_pose(turned, seen)
        turns = to_rotvec(turned[:, upper].astype(np.float64)) * seen[:, upper, None]
        total += turns.reshape(frames, -1)
    smooth = uniform_filter1d(total / len(phases), SMOOTHED, axis=0, mode="nearest")
    return smooth.astype(np.float32)


def _root(leader: dict[str, str], name: str) -> str:
    while leader[name] != name:
        name = leader[name]
    return name
