"""Local rotations of the rig from positions alone (docs, "Local rotations from positions only").

- Pelvis, thorax: X from right to left (hips, shoulders), Y up the trunk. Without a point of the spine between them they
  share their up, so the trunk's bending is not seen, only its twist. The abdomen lies half-way.
- Head: X from ear to ear, Z to the nose. Hand: Y up to the wrist, Z from the little to the index finger.
- Limbs: Y along the bone. A bent elbow or knee is a hinge, and its axis is X of both bones. In a nearly straight limb
  the hinge is undefined: X is carried on from the last time it was bent, relative to the trunk, with the least twist
  (`hinges` in, `hinges` out). Until a limb was bent once, X is that of the smallest turn from hanging and what depends
  on it counts as unobserved: shoulder and wrist, or hip. Elbow and knee are straight then, which is seen.
- Forearms never show how they are turned about themselves.

Absolute angles from landmarks differ by tens of degrees from a suit's; their changes agree. Arithmetic is elementwise:
see `fervor.rotations`.
"""

from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError
from fervor.rotations import between, conjugate, cross, dot, from_matrix, identity, length, multiply, rotate, slerp
from fervor.skeletons.landmarks import POINTS, Landmarks
from fervor.skeletons.rig import JOINTS

F = TypeVar("F", bound=np.floating[Any])
Array = npt.NDArray[Any]
Mask = npt.NDArray[np.bool_]
Straight = Literal["carry", "mask"]
"""A limb too straight to show its hinge counts as observed once the hinge was seen (`carry`), or never (`mask`)."""

LIMBS: tuple[tuple[str, str, str], ...] = (
    ("l_shoulder", "l_elbow", "l_wrist"),
    ("r_shoulder", "r_elbow", "r_wrist"),
    ("l_hip", "l_knee", "l_ankle"),
    ("r_hip", "r_knee", "r_ankle"),
)
"""Points of the limbs, in the order of the state's limb axis; each has an upper and a lower bone."""

LEAST_BEND = 0.25
"""Sine of the angle between two bones under which their hinge is undefined (14°)."""

_HINGE_SIGN = np.array([-1.0, -1.0, 1.0, 1.0])  # [limb] elbows bend forward, knees backward
_TINY = 1e-9

_MIDDLES = (("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("l_ear", "r_ear"), ("l_index", "l_pinky"),
            ("r_index", "r_pinky"))  # fmt: skip
"""Points half-way between two others; they follow `POINTS` in the arrays below."""

_PLACE = {
    point: index for index, point in enumerate((*POINTS, "hips", "shoulders", "ears", "l_knuckles", "r_knuckles"))
}
_SEGMENTS = ("pelvis", "thorax", "head", "l_hand", "r_hand")
_FIRST = (("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("l_ear", "r_ear"), ("l_wrist", "l_knuckles"),
          ("r_wrist", "r_knuckles"))  # fmt: skip
"""Of each of `_SEGMENTS`, to and from which point its first axis leads: X of trunk and head, Y of hands."""

_SECOND = (("shoulders", "hips"), ("shoulders", "hips"), ("nose", "ears"), ("l_index", "l_pinky"),
           ("r_index", "r_pinky"))  # fmt: skip
"""About where its second axis leads: Y of the trunk, Z of head and hands. A seen `spine_mid` parts the trunk's two."""


def _places(*names: str) -> list[int]:
    return [_PLACE[name] for name in names]


@dataclass(frozen=True, slots=True)
class _Measured:
    """What one instant shows by itself, limbs in the axes of their trunk segment."""

    trunk: Array  # [..., 5, 4] spine, chest, head, and the hands relative to the thorax
    trunk_seen: Mask  # [..., 5]
    up: Array  # [..., limb, bone, 3] Y axes
    hinge: Array  # [..., limb, bone, 3] X axes, of no meaning unless bent
    bent: Mask  # [..., limb]
    seen: Mask  # [..., limb] limb and trunk
    limb_seen: Mask  # [..., limb] the limb alone


def no_hinges(shape: tuple[int, ...] = (), dtype: npt.DTypeLike = np.float64) -> Array:
    """The state before the first frame: no hinge was seen, [*shape, limb, bone, 3] all zero."""
    return np.zeros((*shape, len(LIMBS), 2, 3), dtype)


def local_from_positions(
    landmarks: Landmarks,
    positions: npt.NDArray[F],
    observed: Mask,
    hinges: npt.NDArray[F],
    *,
    straight: Straight = "carry",
) -> tuple[npt.NDArray[F], Mask, npt.NDArray[F]]:
    """Local rotations from one instant's points, for any number of bodies at once.

    Args:
        landmarks: the sensor.
        positions: [..., joint, 3], right-handed, any unit.
        observed: [..., joint]; positions that are not finite count as unobserved too.
        hinges: [..., limb, bone, 3] from the frame before, or `no_hinges`.
        straight: what limbs too straight to show their hinge count as.

    Returns:
        Local unit rotations [..., 13, 4], whether each was observed [..., 13], and the hinges for the next frame.

    Raises:
        InputError: another number of points.
    """
    measured = _measure(landmarks, positions, observed)
    axes, known, after = _carry(measured.up, measured.hinge, measured.bent, measured.seen, hinges)
    if straight == "mask":
        known = known & measured.bent
    local, seen = _assemble(measured, axes, known)
    return local, seen, after


def local_over_time(
    landmarks: Landmarks, positions: npt.NDArray[F], observed: Mask, *, straight: Straight = "carry"
) -> tuple[npt.NDArray[F], Mask]:
    """Local rotations [frame, 13, 4] and mask [frame, 13] of a whole recording: the same as frame by frame.

    Args:
        landmarks: the sensor.
        positions: [frame, joint, 3].
        observed: [frame, joint].
        straight: what limbs too straight to show their hinge count as.

    Raises:
        InputError: another number of points.
    """
    measured = _measure(landmarks, positions, observed)
    axes, known = np.empty_like(measured.up), np.empty_like(measured.bent)
    hinges = no_hinges((), positions.dtype)
    for frame in range(len(positions)):
        axes[frame], known[frame], hinges = _carry(
            measured.up[frame], measured.hinge[frame], measured.bent[frame], measured.seen[frame], hinges
        )
    if straight == "mask":
        known &= measured.bent
    return _assemble(measured, axes, known)


def _carry(up: Array, hinge: Array, bent: Mask, seen: Mask, last: Array) -> tuple[Array, Mask, Array]:
    """X axes of the limbs' bones [..., limb, bone, 3], whether they are known [..., limb], and the next state."""
    carried, sound = _unit_beside(last, up)
    known = bent | sound[..., 0] & sound[..., 1]
    down = np.broadcast_to(np.array([0.0, -1.0, 0.0], up.dtype), up.shape)
    across = np.broadcast_to(np.array([1.0, 0.0, 0.0], up.dtype), up.shape)
    guess = rotate(between(down, -up), across)
    axes = np.where(bent[..., None, None], hinge, np.where(known[..., None, None], carried, guess))
    after = np.where((seen & known)[..., None, None], axes, last)
    return axes, known, after


def _measure(landmarks: Landmarks, positions: Array, observed: Mask) -> _Measured:
    """Everything that needs no memory."""
    if positions.shape[-2:] != (len(landmarks.joints), 3) or observed.shape != positions.shape[:-1]:
        raise InputError(
            f"landmark sensor {landmarks.name!r} has {len(landmarks.joints)} points of 3 numbers; "
            f"got positions {list(positions.shape)} and a mask {list(observed.shape)}"
        )
    points, visible = _points(landmarks, positions, observed)
    whole, whole_seen = _segments(points, visible)  # pelvis, thorax, head, hands
    half = slerp(whole[..., 0, :], whole[..., 1, :], 0.5)
    above = np.stack([whole[..., 0, :], half, *[whole[..., 1, :]] * 3], axis=-2)
    below = np.concatenate([half[..., None, :], whole[..., 1:, :]], axis=-2)

    bones, limb_seen = _bones(points, visible)  # [..., limb, bone, 3]
    hinge = cross(bones[..., 0, :], bones[..., 1, :]) * _HINGE_SIGN.astype(points.dtype)[:, None]
    bend = length(hinge)
    hinge = hinge / np.maximum(bend, _TINY)[..., None]
    base = conjugate(whole[..., [1, 1, 0, 0], :])  # [..., limb, 4] into the axes of the trunk segment
    turned = rotate(base[..., None, :], np.concatenate([-bones, hinge[..., None, :]], axis=-2))
    return _Measured(
        trunk=multiply(conjugate(above), below),
        trunk_seen=whole_seen[..., [0, 0, 1, 1, 1]] & whole_seen[..., [1, 1, 2, 3, 4]],
        up=turned[..., :2, :],
        hinge=np.broadcast_to(turned[..., 2:, :], (*turned.shape[:-2], 2, 3)),
        bent=(bend >= LEAST_BEND) & limb_seen,
        seen=limb_seen & whole_seen[..., [1, 1, 0, 0]],
        limb_seen=limb_seen,
    )


def _assemble(measured: _Measured, axes: Array, known: Mask) -> tuple[Array, Mask]:
    """Local rotations of all joints from the frames of all segments."""
    third = cross(axes, measured.up)
    bones = from_matrix(np.stack([axes, measured.up, third], axis=-1))  # [..., limb, bone, 4] in trunk axes
    upper, lower = bones[..., 0, :], bones[..., 1, :]
    outer = np.concatenate([lower, measured.trunk[..., 3:, :]], axis=-2)  # shanks and forearms, then hands
    inner = np.concatenate([upper, lower[..., :2, :]], axis=-2)
    hanging = multiply(conjugate(inner), outer)  # elbows, knees, wrists
    sure = known & measured.seen
    turns = np.concatenate([measured.trunk[..., :3, :], upper, hanging], axis=-2)
    seen = np.concatenate(
        [measured.trunk_seen[..., :3], sure, measured.limb_seen, measured.trunk_seen[..., 3:] & sure[..., :2]], axis=-1
    )
    local, seen = turns[..., _ORDER, :], seen[..., _ORDER]
    return np.where(seen[..., None], local, identity((), local.dtype)), seen


_ASSEMBLED = ("spine", "chest", "head", "l_shoulder", "r_shoulder", "l_hip", "r_hip", "l_elbow", "r_elbow", "l_knee",
              "r_knee", "l_wrist", "r_wrist")  # fmt: skip
_ORDER = [_ASSEMBLED.index(joint) for joint in JOINTS]


def _points(landmarks: Landmarks, positions: Array, observed: Mask) -> tuple[Array, Mask]:
    """All points [..., point, 3] by `_PLACE`, and which are seen [..., point]; unseen ones are at the origin."""
    index = [landmarks.points.get(point, 0) for point in POINTS]
    has = np.array([point in landmarks.points for point in POINTS])
    points = positions[..., index, :]
    with np.errstate(over="ignore", invalid="ignore"):
        seen = observed[..., index] & has & np.isfinite(length(points))
    points = np.where(seen[..., None], points, points.dtype.type(0.0))
    left, right = _places(*(a for a, _ in _MIDDLES)), _places(*(b for _, b in _MIDDLES))
    middles = 0.5 * (points[..., left, :] + points[..., right, :])
    both = seen[..., left] & seen[..., right]
    return np.concatenate([points, middles], axis=-2), np.concatenate([seen, both], axis=-1)


def _segments(points: Array, seen: Mask) -> tuple[Array, Mask]:
    """Orientations of `_SEGMENTS` [..., 5, 4] in the sensor's axes, and which are seen [..., 5]."""
    tips, feet = _places(*(a for a, _ in _FIRST)), _places(*(b for _, b in _FIRST))
    tips2, feet2 = _places(*(a for a, _ in _SECOND)), _places(*(b for _, b in _SECOND))
    there, there_seen = points[..., tips2, :], seen[..., tips2]
    back, back_seen = points[..., feet2, :], seen[..., feet2]
    spine, spine_seen = points[..., _PLACE["spine_mid"], :], seen[..., _PLACE["spine_mid"]]
    there[..., 0, :] = np.where(spine_seen[..., None], spine, there[..., 0, :])
    back[..., 1, :] = np.where(spine_seen[..., None], spine, back[..., 1, :])
    there_seen[..., 0] |= spine_seen
    back_seen[..., 1] |= spine_seen

    first, sound = _unit(points[..., tips, :] - points[..., feet, :])
    second, sound2 = _unit_beside(there - back, first)
    third = cross(first, second)
    trunk, head, hands = slice(0, 2), slice(2, 3), slice(3, 5)
    x = np.concatenate([first[..., trunk, :], first[..., head, :], third[..., hands, :]], axis=-2)
    y = np.concatenate([second[..., trunk, :], -third[..., head, :], first[..., hands, :]], axis=-2)
    z = np.concatenate([third[..., trunk, :], second[..., head, :], second[..., hands, :]], axis=-2)
    whole = from_matrix(np.stack([x, y, z], axis=-1))
    visible = seen[..., tips] & seen[..., feet] & there_seen & back_seen & sound & sound2
    return np.where(visible[..., None], whole, identity((), whole.dtype)), visible


def _bones(points: Array, seen: Mask) -> tuple[Array, Mask]:
    """Directions of the limbs' bones [..., limb, bone, 3], and whether a limb is seen [..., limb]."""
    places = np.array([_places(*limb) for limb in LIMBS])
    at = points[..., places, :]  # [..., limb, 3, 3]
    bones, sound = _unit(at[..., 1:, :] - at[..., :-1, :])
    visible = seen[..., places]
    return bones, visible[..., 0] & visible[..., 1] & visible[..., 2] & sound[..., 0] & sound[..., 1]


def _unit(vector: Array) -> tuple[Array, Mask]:
    """Vectors [..., 3] at unit length, and whether they had any."""
    size = length(vector)
    sound = size > _TINY
    return vector / np.where(sound, size, size.dtype.type(1.0))[..., None], sound


def _unit_beside(vector: Array, unit: Array) -> tuple[Array, Mask]:
    """The unit parts of vectors [..., 3] orthogonal to unit vectors, and whether there is one to speak of."""
    direction, sound = _unit(vector)
    beside = direction - dot(direction, unit)[..., None] * unit
    axis, _ = _unit(beside)
    return axis, sound & (length(beside) > 1e-3)
