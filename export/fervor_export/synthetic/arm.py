"""From hands to joints: where a wrist is and how far the elbow is turned out give shoulder, elbow and wrist rotations.

All arms are solved as left arms with X pointing outward; the right arm is the mirror image (formula 6). The elbow is a
hinge: bending it brings the forearm forward (-X of a hanging arm); `palm` turns the forearm about its own length.
"""

import numpy as np

from fervor import rotations
from fervor_export.synthetic.tracks import Array

SHOULDER = 0.18
"""Metres from the midline to a shoulder."""

_TORSO = (0.165, 0.125)
"""Half width and half depth of the chest in metres: wrists stay outside."""

_HEAD_CENTRE, _HEAD_RADIUS = np.array([0.0, 0.17, 0.03]), 0.125


def _keep_out(inside: Array) -> Array:
    """Factor [...] that moves a point at relative distance `inside` from a centre smoothly to at least 1."""
    safe = np.maximum(inside, 1e-3)
    factor: Array = (safe**8 + 1.0) ** 0.125 / safe
    return factor


def outside_body(wrist: Array) -> Array:
    """Wrists [..., 3] (chest axes, X outward from the midline), moved out of chest and head where they were inside."""
    x, y, z = wrist[..., 0], wrist[..., 1], wrist[..., 2]
    near = 1.0 / (1.0 + np.exp(np.clip((y - 0.02) / 0.02, -30.0, 30.0)))  # the chest ends below the chin
    factor = 1.0 + near * (_keep_out(np.hypot(x / _TORSO[0], z / _TORSO[1])) - 1.0)
    moved = np.stack((x * factor, y, z * factor), axis=-1)
    offset = moved - _HEAD_CENTRE
    out: Array = _HEAD_CENTRE + offset * _keep_out(np.linalg.norm(offset, axis=-1) / _HEAD_RADIUS)[..., None]
    return out


def around_shoulder(way: Array) -> Array:
    """Wrists [..., 3] relative to their shoulder, led around it in front and outside: a hand never passes through."""
    near = np.exp(-((np.linalg.norm(way, axis=-1, keepdims=True) / 0.2) ** 2))
    led: Array = way + near * np.array([0.06, 0.0, 0.26])
    return led


def _unit(vector: Array) -> Array:
    """Vectors [..., 3] at length 1."""
    unit: Array = vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-9)
    return unit


_FRONT = _unit(np.array([0.1, -0.35, 0.9]))
_OUT = _unit(np.array([1.0, 0.0, 0.0]) - _FRONT[0] * _FRONT)
_LOW = np.cross(_OUT, _FRONT)


def _elbow_side(along: Array, angle: Array) -> Array:
    """Unit vectors [..., 3] across `along` towards which the elbow points; `angle` [...] radians turns it outward.

    The elbow's side is chosen for a hand in front and carried over to every other direction by the smallest turn, so it
    never jumps but straight behind the back, where no hand gets: there a field of directions must have its one hole.
    """
    front = np.cos(angle)[..., None] * _LOW + np.sin(angle)[..., None] * _OUT
    share = np.sum(front * along, axis=-1) / np.maximum(1.0 + along @ _FRONT, 0.02)
    return _unit(front - share[..., None] * (_FRONT + along))


def solve(
    wrist: Array, shoulder: Array, *, elbow_out: Array, palm: Array, bend: Array, side: Array, upper: float, fore: float
) -> Array:
    """Shoulder, elbow and wrist rotations [..., 3, 4] of left arms.

    Args:
        wrist: [..., 3] metres in chest axes, X outward from the midline.
        shoulder: [..., 3] the shoulder's place likewise.
        elbow_out: [...] degrees, 0 elbow low, 90 elbow to the side.
        palm: [...] degrees, pronation from thumb-up.
        bend: [...] degrees, wrist towards the palm.
        side: [...] degrees, wrist towards the thumb.
        upper: length of the upper arm in metres.
        fore: length of the forearm in metres.
    """
    way = around_shoulder(wrist - shoulder)
    length = np.linalg.norm(way, axis=-1)
    whole = upper + fore
    # A straight arm is approached, never jumped to.
    reach = whole * 0.998 * np.tanh((length / whole) ** 24) ** (1.0 / 24.0)
    reach = (reach**8 + 0.18**8) ** 0.125  # nor is an elbow bent beyond 145°
    along = way / np.maximum(length, 1e-6)[..., None]  # [..., 3] towards the wrist

    aside = _elbow_side(along, np.radians(elbow_out))
    cosine = np.clip((upper**2 + reach**2 - fore**2) / (2.0 * upper * reach), -1.0, 1.0)
    upper_arm = along * cosine[..., None] + aside * np.sqrt(1.0 - cosine**2)[..., None]

    x = np.cross(along, aside)  # the hinge
    y = -upper_arm
    shoulder_turn = rotations.from_matrix(np.stack((x, y, np.cross(x, y)), axis=-1))
    inner = np.clip((upper**2 + fore**2 - reach**2) / (2.0 * upper * fore), -1.0, 1.0)
    flexion = 180.0 - np.degrees(np.arccos(inner))
    elbow_turn = rotations.from_euler("XY", np.stack((-flexion, -palm), axis=-1))
    wrist_turn = rotations.from_euler("ZX", np.stack((-bend, -side), axis=-1))
    return np.stack((shoulder_turn, elbow_turn, wrist_turn), axis=-2)
