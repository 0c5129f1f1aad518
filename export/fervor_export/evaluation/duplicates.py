"""Recordings that repeat each other under two names: the same file twice, mirrored, cut elsewhere or another phase.

A data set that holds them leaks, however it is split by name. Two recordings count as one where most of the moving
frames of the shorter one are found in the other, in order and at one constant lag, within a few degrees. Poses are
compared by the rotations of the upper body, seven times a second; people never repeat a movement that closely.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from fervor.rotations import to_rotvec
from fervor.skeletons.rig import UPPER_BODY, mirror_pose
from fervor_export.clip import Clip

Floats = npt.NDArray[np.float64]

EVERY = 4
"""Of the frames asked about, one in so many: about seven a second."""

TOLERANCE_RAD = 0.09
"""Root of the summed squares over joints (5°): a 120 Hz phase moves a gesturing body by less."""

MOVING_RAD = 0.10
"""A frame that differs less from the one a second away stands still, and is no evidence."""

SHARE, LEAST = 0.6, 4
"""Of a recording's moving frames, and how many, must be found again."""

LAG_SLACK = 1
"""Frames by which a lag may waver: phases are rounded."""


def groups(clips: Sequence[Clip]) -> dict[str, str]:
    """Recordings that repeat another one, each with the name of the first of its kind, itself included.

    Clips that share a name are one recording already.
    """
    if not clips:
        return {}
    leader = {clip.name: clip.name for clip in clips}
    for a, b in _pairs(clips, [_poses(clip.rotations, clip.mask) for clip in clips]):
        first, second = sorted(_root(leader, clips[index].name) for index in (a, b))
        leader[second] = first
    roots = {name: _root(leader, name) for name in leader}
    sizes = Counter(roots.values())
    return {name: root for name, root in roots.items() if sizes[root] > 1}


def _pairs(clips: Sequence[Clip], poses: Sequence[Floats]) -> set[tuple[int, int]]:
    """Pairs of clips of which one repeats the other."""
    owner = np.concatenate([np.full(len(pose), index) for index, pose in enumerate(poses)])
    frame = np.concatenate([np.arange(len(pose)) for pose in poses])
    tree = KDTree(np.concatenate(poses))
    found = set()
    for index, clip in enumerate(clips):
        for seen in (poses[index], _poses(*mirror_pose(clip.rotations, clip.mask))):
            asked = _moving(seen)
            if len(asked) < LEAST:
                continue
            hits: Any = tree.query_ball_point(seen[asked], TOLERANCE_RAD)
            for other in _repeats(hits, asked, index, owner, frame):
                found.add((min(index, other), max(index, other)))
    return found


def _repeats(
    hits: Sequence[Sequence[int]],
    asked: npt.NDArray[np.intp],
    index: int,
    owner: npt.NDArray[np.intp],
    frame: npt.NDArray[np.intp],
) -> list[int]:
    """Clips in which enough of the frames `asked` are found at one lag."""
    votes: Counter[tuple[int, int]] = Counter()
    for at, hit in zip(asked, hits, strict=True):
        lags = {
            (int(owner[place]), int(frame[place] - at) + slack)
            for place in hit
            if owner[place] != index
            for slack in range(-LAG_SLACK, LAG_SLACK + 1)
        }
        votes.update(lags)
    needed = max(LEAST, SHARE * len(asked))
    return sorted({other for (other, _), count in votes.items() if count >= needed})


def _poses(rotations: npt.NDArray[np.float32], mask: npt.NDArray[np.bool_]) -> Floats:
    """Upper bodies [frame, 27] as rotation vectors; what was not observed is zero."""
    upper = list(UPPER_BODY)
    turns = to_rotvec(rotations[:, upper].astype(np.float64)) * mask[:, upper, None]
    return turns.reshape(len(turns), -1)


def _moving(poses: Floats) -> npt.NDArray[np.intp]:
    """Every so many frames, those where the body moves."""
    away = np.minimum(np.arange(len(poses)) + 30, len(poses) - 1)
    back = np.maximum(np.arange(len(poses)) - 30, 0)
    moved = np.maximum(*(np.linalg.norm(poses - poses[other], axis=1) for other in (away, back)))
    asked = np.arange(0, len(poses), EVERY)
    moving: npt.NDArray[np.intp] = asked[moved[asked] > MOVING_RAD]
    return moving


def _root(leader: dict[str, str], name: str) -> str:
    while leader[name] != name:
        name = leader[name]
    return name
