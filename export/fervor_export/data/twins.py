"""The same motion under two names: copies, mirror images, other cuts of one take. In folds they would be a leak.

Files are compared at their own rate, by fingerprints. Two are twins where a fifth of the shorter one's poses, and at
least `LEAST_SHARED`, stand in the other too, as they are or mirrored: no two moments of a life are equal to the last
digits. What was smoothed, or sampled at other times, is not found here but by `evaluation.duplicates`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor_export.data.motion import Motion, Prints

LEAST_SHARED = 8
"""Different poses that twins share at least."""

LEAST_SHARE = 0.2
"""Share of the shorter one's different poses that twins share at least."""

COMMON = 40
"""A pose that more recordings have than this is one that software puts there."""


@dataclass(frozen=True, slots=True, order=True)
class Twins:
    """Two recordings with the same motion, by their index; `first` stands before `second`."""

    first: int
    second: int
    mirrored: bool


def find_twins(motions: Sequence[Motion]) -> list[Twins]:
    """All pairs of twins, in order; a pair that is both a copy and a mirror image is a copy."""
    plain = [np.unique(motion.prints) for motion in motions]
    turned = [np.unique(motion.mirrored) for motion in motions]
    found: dict[tuple[int, int], Twins] = {}
    for mirrored, others in ((False, plain), (True, turned)):
        for (first, second), shared in _shared(plain, others).items():
            if shared >= max(LEAST_SHARED, LEAST_SHARE * min(len(plain[first]), len(plain[second]))):
                found.setdefault((first, second), Twins(first, second, mirrored))
    return sorted(found.values())


def _shared(ours: Sequence[Prints], others: Sequence[Prints]) -> Counter[tuple[int, int]]:
    """How many poses ours [i] and the others' [j] have in common, for all i < j with any."""
    values, owners = _sorted(ours)
    asked, askers = _sorted(others)
    starts, ends = np.searchsorted(values, asked, "left"), np.searchsorted(values, asked, "right")
    held = np.flatnonzero((ends > starts) & (ends - starts <= COMMON))
    held = held[(ends[held] - starts[held] > 1) | (owners[starts[held]] != askers[held])]  # not the asker's alone
    counts: Counter[tuple[int, int]] = Counter()
    for asker, start, end in zip(askers[held].tolist(), starts[held].tolist(), ends[held].tolist(), strict=True):
        counts.update((owner, asker) for owner in owners[start:end].tolist() if owner < asker)
    return counts


def _sorted(lists: Sequence[Prints]) -> tuple[Prints, npt.NDArray[np.intp]]:
    """All fingerprints in order, and whose each is."""
    values = np.concatenate([*lists, np.zeros(0, np.uint64)])
    owners = np.repeat(np.arange(len(lists)), [len(prints) for prints in lists])
    order = np.argsort(values, kind="stable")
    return values[order], owners[order]
