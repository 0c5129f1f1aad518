"""Landmark sensors: named points in space instead of rotations. Data, no code; `positions` does the arithmetic.

Points must be three-dimensional, in one right-handed set of axes, any unit. An image, or the picture of a mirroring
camera, will not do: mirrored points must be swapped back first, or every rotation is wrong.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from fervor.errors import InputError
from fervor.skeletons.rig import JOINTS


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """The points of one kind of sensor."""

    name: str
    title: str
    """For people."""
    joints: tuple[str, ...]
    """Names of the points, in the order in which the source sends them."""
    points: Mapping[str, int]
    """Which joint is which point of `POINTS`; what is missing is never seen."""
    noisy: bool = True
    """Detectors confuse left and right for a frame: jumps over 120° count as untracked."""

    @property
    def sees(self) -> tuple[bool, ...]:
        """For each rig joint, whether its rotation can be worked out from these points: [13]."""
        return tuple(all(point in self.points for point in NEEDED[joint]) for joint in JOINTS)


POINTS: tuple[str, ...] = (
    "nose",
    "l_ear",
    "r_ear",
    "spine_mid",
    "l_shoulder",
    "l_elbow",
    "l_wrist",
    "l_index",
    "l_pinky",
    "r_shoulder",
    "r_elbow",
    "r_wrist",
    "r_index",
    "r_pinky",
    "l_hip",
    "l_knee",
    "l_ankle",
    "r_hip",
    "r_knee",
    "r_ankle",
)
"""Points that local rotations are worked out from; index and pinky are the roots of those fingers."""


_HIPS, _SHOULDERS = ("l_hip", "r_hip"), ("l_shoulder", "r_shoulder")

NEEDED: Mapping[str, tuple[str, ...]] = {
    "spine": (*_HIPS, *_SHOULDERS),
    "chest": (*_HIPS, *_SHOULDERS),
    "head": (*_HIPS, *_SHOULDERS, "l_ear", "r_ear", "nose"),
    **{
        f"{side}_{joint}": (*_HIPS, *_SHOULDERS, *(f"{side}_{point}" for point in points))
        for side in "lr"
        for joint, points in {
            "shoulder": ("elbow", "wrist"),
            "elbow": ("elbow", "wrist"),
            "wrist": ("elbow", "wrist", "index", "pinky"),
            "hip": ("knee", "ankle"),
            "knee": ("knee", "ankle"),
        }.items()
    },
}
"""Points that each rig joint is worked out from."""


def _points_by_name(joints: tuple[str, ...], words: Mapping[str, str]) -> dict[str, int]:
    """Points found in `joints` by their names, with "left_" or "right_" (or a letter) as `words` says."""
    named = {point: f"{words[point[0]]}{point[2:]}" if point[1] == "_" else point for point in POINTS}
    return {point: joints.index(name) for point, name in named.items() if name in joints}


_FACE = ("nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer")
_MEDIAPIPE = (
    *_FACE,
    "left_ear",
    "right_ear",
    "mouth_left",
    "mouth_right",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_pinky",
    "right_pinky",
    "left_index",
    "right_index",
    "left_thumb",
    "right_thumb",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
    "left_heel",
    "right_heel",
    "left_foot_index",
    "right_foot_index",
)
_COCO17 = (
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
)
_BODY25 = (
    "Nose",
    "Neck",
    "RShoulder",
    "RElbow",
    "RWrist",
    "LShoulder",
    "LElbow",
    "LWrist",
    "MidHip",
    "RHip",
    "RKnee",
    "RAnkle",
    "LHip",
    "LKnee",
    "LAnkle",
    "REye",
    "LEye",
    "REar",
    "LEar",
    "LBigToe",
    "LSmallToe",
    "LHeel",
    "RBigToe",
    "RSmallToe",
    "RHeel",
)
_WORDS = {"l": "left_", "r": "right_"}

MEDIAPIPE = Landmarks(
    name="mediapipe",
    title="MediaPipe Pose, world landmarks (33 points)",
    joints=_MEDIAPIPE,
    points=_points_by_name(_MEDIAPIPE, _WORDS),
)
COCO17 = Landmarks(
    name="coco17",
    title="COCO keypoints in space (17 points)",
    joints=_COCO17,
    points=_points_by_name(_COCO17, _WORDS),
)
BODY25 = Landmarks(
    name="body25",
    title="OpenPose BODY_25 in space (25 points)",
    joints=_BODY25,
    points=_points_by_name(tuple(name.lower() for name in _BODY25), {"l": "l", "r": "r"}),
)
BODY_POINTS = Landmarks(
    name="points",
    title="Named body points (any motion capture)",
    joints=POINTS,
    points={point: index for index, point in enumerate(POINTS)},
)
"""For points of any other source: name them as in `POINTS`, as far as there are any."""

LANDMARKS: Mapping[str, Landmarks] = {known.name: known for known in (MEDIAPIPE, COCO17, BODY25, BODY_POINTS)}
"""Landmark sensors by name."""


def landmarks(name: str) -> Landmarks:
    """The landmark sensor called `name`, in any case and with - for _.

    Raises:
        InputError: no such sensor.
    """
    known = LANDMARKS.get(name.strip().lower().replace("-", "_"))
    if known is None:
        raise InputError(f"landmark sensor {name!r} is not known; expected one of {', '.join(LANDMARKS)}")
    return known
