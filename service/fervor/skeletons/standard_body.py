"""A standard body: where the joints are in space, worked out from rig rotations (forward kinematics).

Pictures, BVH files and handcrafted features are about positions, rotations are what a pose has; so every pose is put
on one body. Bones are a 1.70 m adult's (Winter 2009, Biomechanics and Motor Control of Human Movement, table 4.1 and
figure 4.1, shares of the height; trunk split at L4/L5 and T12). Axes of the rig: X left, Y up, Z forward; the pelvis is
upright at the origin, as the rig has no root.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fervor.rotations import multiply, rotate
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS

Floats = npt.NDArray[np.float64]
Offset = tuple[float, float, float]

BONES: Mapping[str, tuple[str, str, Offset]] = {
    "spine": ("", "pelvis", (0.0, 0.10, 0.0)),
    "spine_mid": ("spine", "abdomen", (0.0, 0.17, 0.0)),
    "midshoulder": ("spine_mid", "thorax", (0.0, 0.22, 0.0)),
    "neck": ("spine_mid", "thorax", (0.0, 0.27, 0.0)),
    "head": ("neck", "head", (0.0, 0.14, 0.02)),
    "nose": ("neck", "head", (0.0, 0.12, 0.11)),
    "l_ear": ("neck", "head", (0.07, 0.13, 0.0)),
    "l_shoulder": ("spine_mid", "thorax", (0.17, 0.22, 0.0)),
    "l_elbow": ("l_shoulder", "l_uparm", (0.0, -0.32, 0.0)),
    "l_wrist": ("l_elbow", "l_forearm", (0.0, -0.25, 0.0)),
    "l_index": ("l_wrist", "l_hand", (0.0, -0.09, 0.03)),
    "l_pinky": ("l_wrist", "l_hand", (0.0, -0.08, -0.03)),
    "l_hip": ("", "pelvis", (0.09, 0.0, 0.0)),
    "l_knee": ("l_hip", "l_thigh", (0.0, -0.42, 0.0)),
    "l_ankle": ("l_knee", "l_shank", (0.0, -0.42, 0.0)),
}
"""Point: from which point ("" the middle of the hips), with which segment, and where (metres; left, up, forward)."""

HIPS_ABOVE_GROUND_M = 0.906
"""Of the standing body: its legs, and an ankle of 0.066 m."""

_TURNS_AT: Mapping[str, str] = {
    "abdomen": "spine", "thorax": "spine_mid", "head": "neck", "l_uparm": "l_shoulder", "l_forearm": "l_elbow",
    "l_hand": "l_wrist", "l_thigh": "l_hip", "l_shank": "l_knee",
}  # fmt: skip
"""The point about which a segment turns; always one that the segment above carries."""


def _both_sides(left: Mapping[str, Offset]) -> dict[str, Offset]:
    """The same for the right side's segments, too."""
    return {**left, **{f"r{name[1:]}": (0.0 - x, y, z) for name, (x, y, z) in left.items() if name.startswith("l_")}}


OFFSETS_M: Mapping[str, Offset] = _both_sides({segment: BONES[point][2] for segment, point in _TURNS_AT.items()})
"""Where a segment turns, from where the segment above it turns; the pelvis turns in the middle of the hips."""

TIPS_M: Mapping[str, Offset] = _both_sides(
    {"head": (0.0, 0.25, 0.0), "l_hand": (0.0, -0.18, 0.0), "l_shank": BONES["l_ankle"][2]}
)
"""Where segments end that carry no other, from where they turn: the crown, the fingertips, the ankles."""

MIDHIP = "midhip"

LIMBS = (
    (MIDHIP, "spine"), ("spine", "spine_mid"), ("spine_mid", "neck"), ("neck", "head"),
    *((f"{side}_{a}", f"{side}_{b}") for side in "lr" for a, b in (
        ("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "index"), ("hip", "knee"), ("knee", "ankle"))),
    *((middle, f"{side}_{end}") for side in "lr" for middle, end in (("neck", "shoulder"), (MIDHIP, "hip"))),
)  # fmt: skip
"""What is drawn of a body: lines, by their ends."""


def points(
    rotations: npt.NDArray[np.floating], *, scale: float = 1.0, bones: Mapping[str, float] | None = None
) -> dict[str, Floats]:
    """Where the points of a body are, [frame, 3] metres each, left and right, and `midhip` at the origin.

    Args:
        rotations: [frame, 13, 4] xyzw, local, rig C13.
        scale: factor of all bones.
        bones: further factors of single bones by their point, without the side: `{"elbow": 1.3}`.
    """
    turned = segments(rotations)
    at: dict[str, Floats] = {"": np.zeros((len(rotations), 3))}
    for name, (start, segment, offset) in BONES.items():
        kind = name.removeprefix("l_")
        bone = np.asarray(offset) * scale * (bones or {}).get(kind, 1.0)
        at[name] = at[start] + rotate(turned[segment], bone)
        if name != kind:
            other = "r" + segment[1:] if segment.startswith("l_") else segment
            below = "r" + start[1:] if start.startswith("l_") else start
            at["r_" + kind] = at[below] + rotate(turned[other], bone * np.array([-1.0, 1.0, 1.0]))
    at[MIDHIP] = at.pop("")
    return at


def segments(rotations: npt.NDArray[np.floating]) -> dict[str, Floats]:
    """Orientation of every segment [frame, 4] relative to the pelvis, from local rotations [frame, 13, 4]."""
    local = rotations.astype(np.float64)
    whole: list[Floats] = [np.tile([0.0, 0.0, 0.0, 1.0], (len(local), 1))] * len(SEGMENTS)
    for joint in range(len(JOINTS)):
        whole[CHILD_SEGMENT[joint]] = multiply(whole[PARENT_SEGMENT[joint]], local[:, joint])
    return dict(zip(SEGMENTS, whole, strict=True))
