"""An average body for the rig, where rotations alone are to become a picture: in BVH files, and on the live page.

Joints stand in the N-pose, in the body's axes (X left, Y up, Z forward); lengths are in centimetres. Proportions are
those of an adult of 175 cm; nothing that is computed from rotations depends on them.
"""

from collections.abc import Mapping

Offset = tuple[float, float, float]

OFFSETS_CM: Mapping[str, Offset] = {
    "pelvis": (0, 95, 0),
    "abdomen": (0, 12, 0),
    "thorax": (0, 14, 0),
    "head": (0, 32, 0),
    "l_uparm": (18, 24, 0),
    "l_forearm": (0, -29, 0),
    "l_hand": (0, -26, 0),
    "r_uparm": (-18, 24, 0),
    "r_forearm": (0, -29, 0),
    "r_hand": (0, -26, 0),
    "l_thigh": (9, -3, 0),
    "l_shank": (0, -43, 0),
    "r_thigh": (-9, -3, 0),
    "r_shank": (0, -43, 0),
}
"""Where the joint that moves a segment stands, from the joint of the segment above; of the pelvis, from the ground."""

TIPS_CM: Mapping[str, float] = {"head": 18, "l_hand": -18, "r_hand": -18, "l_shank": -44, "r_shank": -44}
"""Where segments end that carry no other, along Y."""
