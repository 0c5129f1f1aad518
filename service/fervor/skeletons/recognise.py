"""A skeleton for a joint tree that comes with a file: segments from names, bind alignment from the zero pose.

The zero pose is what the offsets draw when every rotation is the identity. It is read from the offsets, never from the
skeleton's name: files with EBMDB's names exist with hanging and with outstretched arms.

- C: the person's left (from the right to the left limbs) and up (from the pelvis to the shoulders), each taken as the
  nearest axis of the file, give the turn from the file's axes to left, up, forward.
- Arms: T_j is the smallest turn from hanging straight down to the bone's direction in the zero pose. Hanging arms (an
  N-pose) give the identity, outstretched ones (a T-pose) Rz(±90°), arms at 45° (an A-pose) Rz(±45°). Within 5° of
  hanging or of straight sideways they are taken as exactly that. A hand goes with its forearm.
- Trunk, head and legs: T_j is the identity. They count from where the zero pose puts them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, between, from_matrix, rotate
from fervor.skeletons.binds import LEFT_ARM, RIGHT_ARM, Quaternion, bind_of
from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.naming import ancestors, find_segments
from fervor.skeletons.rig import SEGMENTS
from fervor.skeletons.skeleton import Skeleton

Vector = npt.NDArray[np.float64]  # [3]

HANGING: Vector = np.array([0.0, -1.0, 0.0])
SNAP_COSINE = float(np.cos(np.radians(5.0)))
"""Directions nearer than this to hanging or straight sideways are taken as exactly that."""


def recognise(
    joints: Sequence[str],
    parents: Sequence[int],
    offsets: npt.NDArray[np.float64],
    *,
    ends: Mapping[int, Vector] | None = None,
    segments: Mapping[str, str | None] | None = None,
) -> Skeleton:
    """The skeleton of a joint tree with local rotations.

    Args:
        joints: names, parents before children.
        parents: index of each joint's parent; -1 for a root.
        offsets: [joint, 3] from the parent, in the zero pose, any unit.
        ends: offsets of end sites, by the joint that carries them.
        segments: joint names of segments that the caller knows better; None for a segment to leave unseen.

    Raises:
        InputError: not even thorax, upper arms and forearms can be found, or the map of segments doesn't fit.
    """
    found = find_segments(joints, parents, segments)
    axes = _axes(parents, offsets, found)
    pose = _arms(parents, offsets, ends or {}, found, axes)
    bind = bind_of(axes, pose)
    return Skeleton(
        name="bvh",
        title=_title(joints, pose),
        joints=tuple(joints),
        parents=tuple(parents),
        axes="local",
        drives=tuple(found.get(segment) for segment in SEGMENTS),
        bind=np.stack([bind[segment] for segment in SEGMENTS]),
    )


def _title(joints: Sequence[str], pose: Mapping[str, Quaternion]) -> str:
    """For people: how many joints, whose names, which zero pose."""
    names = next((f", named as {known.name}" for known in SKELETONS.values() if set(known.joints) == set(joints)), "")
    turns = [float(np.degrees(2.0 * np.arccos(np.clip(pose[arm][3], -1.0, 1.0)))) for arm in ("l_uparm", "r_uparm")]
    zero = "N" if max(turns) < 1e-6 else "T" if min(turns) > 89.999 else "A"
    return f"BVH ({len(joints)} joints{names}, zero pose {zero})"


def _positions(parents: Sequence[int], offsets: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Positions [joint, 3] in the zero pose."""
    positions = np.zeros_like(offsets)
    for joint, parent in enumerate(parents):
        positions[joint] = offsets[joint] + (positions[parent] if parent >= 0 else 0.0)
    return positions


def _axes(parents: Sequence[int], offsets: npt.NDArray[np.float64], found: Mapping[str, int]) -> Quaternion:
    """C: from the file's axes to left, up, forward; the identity where the zero pose does not tell."""
    at = {segment: _positions(parents, offsets)[joint] for segment, joint in found.items()}
    shoulders = at["l_uparm"] + at["r_uparm"]
    left = at["l_uparm"] - at["r_uparm"]
    low = 2.0 * at.get("pelvis", at["thorax"])
    if "l_thigh" in at and "r_thigh" in at:
        left = left + at["l_thigh"] - at["r_thigh"]
        low = at["l_thigh"] + at["r_thigh"]
    left, up = _nearest_axis(left), _nearest_axis(shoulders - low)
    if not left.any() or not up.any() or np.dot(left, up) != 0.0:
        return IDENTITY
    return from_matrix(np.stack([left, up, np.cross(left, up)]))


def _nearest_axis(direction: Vector) -> Vector:
    """The signed coordinate axis nearest to a direction; zero for no direction."""
    axis = np.zeros(3)
    largest = int(np.abs(direction).argmax())
    axis[largest] = np.sign(direction[largest])
    return axis


def _arms(
    parents: Sequence[int],
    offsets: npt.NDArray[np.float64],
    ends: Mapping[int, Vector],
    found: Mapping[str, int],
    axes: Quaternion,
) -> dict[str, Quaternion]:
    """T_j of the arm segments."""
    pose: dict[str, Quaternion] = {}
    positions = _positions(parents, offsets)
    for uparm, forearm, hand in (LEFT_ARM, RIGHT_ARM):
        elbow = positions[found[forearm]]
        pose[uparm] = _turn(rotate(axes, elbow - positions[found[uparm]]), IDENTITY)
        tip = positions[found[hand]] if hand in found else _tip(parents, positions, ends, found[forearm])
        pose[forearm] = _turn(rotate(axes, tip - elbow), pose[uparm])
        pose[hand] = pose[forearm]
    return pose


def _tip(
    parents: Sequence[int], positions: npt.NDArray[np.float64], ends: Mapping[int, Vector], joint: int
) -> npt.NDArray[Any]:
    """Where the bone that starts at `joint` ends: its end site, its first child, or itself."""
    if joint in ends:
        return np.asarray(positions[joint] + ends[joint])
    below = [other for other in range(len(parents)) if joint in ancestors(parents, other)]
    return np.asarray(positions[below[0]] if below else positions[joint])


def _turn(direction: Vector, otherwise: Quaternion) -> Quaternion:
    """The smallest turn from hanging to `direction`; `otherwise` where it has no length."""
    size = float(np.sqrt(direction @ direction))
    if size < 1e-9:
        return otherwise
    unit = direction / size
    for exact in (HANGING, np.array([1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])):
        if float(unit @ exact) > SNAP_COSINE:
            unit = exact
    return between(HANGING, unit)
