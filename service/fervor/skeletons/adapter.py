"""The adapter: a source's rotations become the rig's 13 local rotations (formula 3).

For the rig joint between segments p and j with drives P and J: L = A_p · (Q_P^-1 · Q_J) · A_j^-1. With local rotations
Q_P^-1 · Q_J is the product along the path from P to J in the source's tree, so that joints above both, and with them
the sensor's place, never enter. A joint counts as untracked where the source says so or its quaternion is no rotation
(shorter than 0.5, not finite: Kinect sends zeros for leaf joints); then every rig joint whose path passes it is
unobserved and the identity. All arithmetic is elementwise: see `fervor.rotations`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError
from fervor.rotations import IDENTITY, conjugate, identity, length, product, small_product
from fervor.skeletons.rig import CHILD_SEGMENT, PARENT_SEGMENT
from fervor.skeletons.skeleton import ROOT, Axes, Skeleton

F = TypeVar("F", bound=np.floating[Any])

SHORTEST = 0.5
"""Least length of a quaternion that counts as one (formula 5)."""

SMALL = 200
"""Rotations up to which `small_product` is the faster one, as measured."""


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """Which source joints make up each rig joint. Paths are padded with the index of the last used joint."""

    used: npt.NDArray[np.intp]  # [used] the source joints that matter; the last one stands for the identity
    direct: npt.NDArray[np.intp] | slice | None  # [13] the source joint that each rig joint is as it is, if all are
    up: npt.NDArray[np.intp]  # [step, 13] used joints to multiply, from below the common ancestor to P; then inverted
    down: npt.NDArray[np.intp]  # [step, 13] likewise to J
    sees: npt.NDArray[np.bool_]  # [13]
    aligned: bool  # all A are the identity
    above: npt.NDArray[np.float64]  # [4, 13] A_p
    below: npt.NDArray[np.float64]  # [4, 13] A_j^-1


def adapt(
    skeleton: Skeleton, rotations: npt.NDArray[F], observed: npt.NDArray[np.bool_], *, axes: Axes
) -> tuple[npt.NDArray[F], npt.NDArray[np.bool_]]:
    """The rig's local rotations from a source's.

    Args:
        skeleton: the source.
        rotations: [..., joint, 4] xyzw, in the skeleton's joint order; need not be of unit length.
        observed: [..., joint], False where the source did not track a joint.
        axes: whether the rotations are relative to the parent joint or to the sensor.

    Returns:
        Local unit rotations [..., 13, 4] of the caller's dtype, and whether each was observed [..., 13].

    Raises:
        InputError: another number of joints, or global rotations of a skeleton without a pelvis.
    """
    if rotations.shape[-2:] != (len(skeleton.joints), 4) or observed.shape != rotations.shape[:-1]:
        raise InputError(
            f"skeleton {skeleton.name!r} has {len(skeleton.joints)} joints of 4 numbers; "
            f"got rotations {list(rotations.shape)} and a mask {list(observed.shape)}"
        )
    plan = _plan(skeleton, axes)
    if plan.direct is not None:  # nothing is to be multiplied
        return _clean(rotations[..., plan.direct, :], observed[..., plan.direct])
    chosen, there = rotations.take(plan.used, axis=-2), observed.take(plan.used, axis=-1)
    chosen[..., -1, :], there[..., -1] = IDENTITY, True
    units, tracked = _clean(chosen, there)
    turn, seen = _along(plan.down, units, tracked)
    times = _times(seen)
    if len(plan.up):
        (x, y, z, w), seen_back = _along(plan.up, units, tracked)
        turn, seen = times((-x, -y, -z, w), turn), seen & seen_back
    if not plan.aligned:
        binds = (4, *(1,) * (seen.ndim - 1), -1)
        above, below = (bind.astype(units.dtype).reshape(binds) for bind in (plan.above, plan.below))
        turn = times(times(above, turn), below)
    seen = seen & plan.sees
    local = identity(seen.shape, units.dtype)
    for index, part in enumerate(turn):
        np.copyto(local[..., index], part, where=seen)
    return local, seen


def _clean(rotations: npt.NDArray[F], observed: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[F], npt.NDArray[np.bool_]]:
    """Unit rotations [..., joint, 4], the identity where they were not tracked, and where they were [..., joint]."""
    with np.errstate(over="ignore", invalid="ignore"):  # numbers too large to be rotations are untracked
        size = length(rotations)
        tracked = (size >= SHORTEST) & (size < np.inf)
    tracked &= observed
    if tracked.all():
        return np.divide(rotations, size[..., None], order="C"), tracked
    units = identity(size.shape, rotations.dtype)
    np.divide(rotations, size[..., None], out=units, where=tracked[..., None])
    return units, tracked


def check_axes(skeleton: Skeleton, axes: Axes) -> None:
    """Whether rotations in these axes can be adapted at all.

    Raises:
        InputError: global rotations of a skeleton without a pelvis.
    """
    if axes == "global" and skeleton.needs_local:
        raise InputError(f"skeleton {skeleton.name!r} has no pelvis joint; expected local rotations, not global ones")


def _along(
    path: npt.NDArray[np.intp], units: npt.NDArray[F], tracked: npt.NDArray[np.bool_]
) -> tuple[Iterable[Any], npt.NDArray[np.bool_]]:
    """Products of rotations along paths [step, 13], as components, and whether all of a path was tracked."""
    turn: Iterable[Any] = _components(units, path[0])
    seen = tracked.take(path[0], axis=-1)
    times = _times(seen)
    for step in path[1:]:
        turn, seen = times(turn, _components(units, step)), seen & tracked.take(step, axis=-1)
    return turn, seen


def _times(seen: npt.NDArray[np.bool_]) -> Callable[[Iterable[Any], Iterable[Any]], Iterable[Any]]:
    """How to multiply as many rotations [4, ...] as were seen or not [...]; to the bit the same."""
    return small_product if seen.size <= SMALL else product


def _components(units: npt.NDArray[F], joints: npt.NDArray[np.intp]) -> npt.NDArray[F]:
    """Of these joints [13] as arrays of their own [4, ..., 13]: with these, numpy multiplies fastest."""
    return np.ascontiguousarray(np.moveaxis(units.take(joints, axis=-2), -1, 0))


@lru_cache(maxsize=64)
def _plan(skeleton: Skeleton, axes: Axes) -> _Plan:
    """Paths and binds of a skeleton, worked out once."""
    check_axes(skeleton, axes)
    ups: list[list[int]] = []
    downs: list[list[int]] = []
    for above, below, seen in zip(PARENT_SEGMENT, CHILD_SEGMENT, skeleton.sees, strict=True):
        start, end = skeleton.drives[above], skeleton.drives[below]
        if not seen or start is None or end is None:
            up, down = [], []
        elif axes == "global":
            up, down = [start], [end]
        else:
            up, down = _path(skeleton.parents, start), _path(skeleton.parents, end)
            shared = sum(1 for a, b in zip(up, down, strict=False) if a == b)
            up, down = up[shared:], down[shared:]
        ups.append(up)
        downs.append(down)
    used = sorted({joint for path in (*ups, *downs) for joint in path})
    aligned = bool((skeleton.bind == IDENTITY).all())
    return _Plan(
        used=np.array([*used, 0], np.intp),
        direct=_direct(downs, len(skeleton.joints)) if aligned and not any(ups) else None,
        up=_padded(ups, used),
        down=_padded(downs, used) if any(downs) else np.full((1, len(downs)), len(used), np.intp),
        sees=np.array(skeleton.sees),
        aligned=aligned,
        above=np.ascontiguousarray(skeleton.bind[list(PARENT_SEGMENT)].T),
        below=np.ascontiguousarray(conjugate(skeleton.bind[list(CHILD_SEGMENT)]).T),
    )


def _direct(paths: list[list[int]], joints: int) -> npt.NDArray[np.intp] | slice | None:
    """The joints that the paths are, where each is one of the source's; a slice for all of them in order."""
    if any(len(path) != 1 for path in paths):
        return None
    ends = [path[0] for path in paths]
    return slice(None) if ends == [*range(joints)] else np.array(ends, np.intp)


def _path(parents: tuple[int, ...], joint: int) -> list[int]:
    """Joints from the root down to `joint`; none for `ROOT`."""
    path: list[int] = []
    while joint != ROOT:
        path.append(joint)
        joint = parents[joint]
    return path[::-1]


def _padded(paths: list[list[int]], used: list[int]) -> npt.NDArray[np.intp]:
    """Paths of different lengths as one array [step, path] of places among the used joints."""
    steps = max(len(path) for path in paths)
    padded = np.full((steps, len(paths)), len(used), np.intp)
    for column, path in enumerate(paths):
        padded[: len(path), column] = [used.index(joint) for joint in path]
    return padded
