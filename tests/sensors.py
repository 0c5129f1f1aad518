"""One motion as every sensor would report it, for tests and for bench.

The renderer knows nothing of the alignments A_j: it is built from what the sensors' documentation says, the direction
of each joint's axes while a person stands in a T-pose (or N-pose), and from where the camera is. Points of landmark
sensors are those of a body with bones.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fervor.skeletons.landmarks import POINTS, Landmarks
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.skeleton import ROOT, Skeleton

Array = npt.NDArray[np.float64]
HERE = Rotation.identity()
"""A camera that sees left as X, up as Y, forward as Z."""

TURN_T = {"l": Rotation.from_euler("z", 90, degrees=True), "r": Rotation.from_euler("z", -90, degrees=True)}
DIRECTIONS = {"L": [1, 0, 0], "U": [0, 1, 0], "F": [0, 0, 1]}


def axes_along(text: str) -> Rotation:
    """Joint axes x, y, z as directions of the body: "-U +L +F"."""
    columns = [np.array(DIRECTIONS[word[1]]) * (1 if word[0] == "+" else -1) for word in text.split()]
    return Rotation.from_matrix(np.stack(columns, axis=1))


def per_segment(**groups: str) -> dict[str, Rotation]:
    """Joint axes of all segments from those of groups of segments."""
    table = {}
    for segment in SEGMENTS:
        side, _, part = segment.rpartition("_")
        kind = part if side else "trunk"
        group = {"uparm": "arm", "forearm": "arm", "thigh": "leg", "shank": "leg"}.get(kind, kind)
        name = f"{side}_{group}" if side else "trunk"
        table[segment] = axes_along(groups.get(name, groups.get(f"{side}_arm", "") if group == "hand" else ""))
    return table


BODY = "+L +U +F"
ROS = "+F +L +U"
T_POSE_AXES: Mapping[str, dict[str, Rotation]] = {
    "kinect_v2": per_segment(
        trunk=BODY, l_arm="-U +L +F", r_arm="+U -L +F", l_leg="+F -U +L", r_leg="-F -U -L"
    ),
    "azure_kinect": per_segment(
        trunk="+U +F +L", l_leg="+U +F +L", r_leg="-U -F +L", l_arm="+L +F -U", r_arm="+L -F +U",
        l_hand="+L +U +F", r_hand="+L -U -F",
    ),
    "xsens_mvn": per_segment(trunk=ROS, l_arm=ROS, r_arm=ROS, l_leg=ROS, r_leg=ROS),
    "smpl": per_segment(trunk=BODY, l_arm=BODY, r_arm=BODY, l_leg=BODY, r_leg=BODY),
    "nite": per_segment(trunk="-L +U -F", l_arm="-L +U -F", r_arm="-L +U -F", l_leg="-L +U -F", r_leg="-L +U -F"),
}  # fmt: skip
"""Joint axes during a T-pose, from the tables of the sensors."""
T_POSE_AXES = {
    **T_POSE_AXES,
    "kinect_v1": T_POSE_AXES["kinect_v2"],
    "nuitrack": T_POSE_AXES["nite"],
    "cmu": T_POSE_AXES["smpl"],
}
N_POSE_AXES: Mapping[str, dict[str, Rotation]] = {
    "ebmdb": per_segment(trunk=BODY, l_arm=BODY, r_arm=BODY, l_leg=BODY, r_leg=BODY),
    "ros4hri": per_segment(trunk=ROS, l_arm=ROS, r_arm=ROS, l_leg=ROS, r_leg=ROS),
}
"""Joint axes during an N-pose."""

UNSEEN = {
    "nite": {"spine", "chest", "l_wrist", "r_wrist", "l_hip", "r_hip"},
    "nuitrack": {"chest", "l_wrist", "r_wrist"},
    "ros4hri": {"chest", "l_wrist", "r_wrist"},
}
"""Rig joints that a sensor can't see."""


def axes_in_n_pose(name: str) -> dict[str, Rotation]:
    if name in N_POSE_AXES:
        return N_POSE_AXES[name]
    return {
        segment: (TURN_T[segment[0]].inv() if segment.endswith(("arm", "hand")) else HERE) * turn
        for segment, turn in T_POSE_AXES[name].items()
    }


def t_pose() -> Array:
    """The rig's local rotations [13, 4] of a T-pose."""
    local = np.tile([0.0, 0.0, 0.0, 1.0], (len(JOINTS), 1))
    for side in "lr":
        local[JOINTS.index(f"{side}_shoulder")] = TURN_T[side].as_quat()
    return local


def body_in_space(local: Array) -> list[Rotation]:
    """Absolute orientation of every segment in body axes, the pelvis upright, for poses [frame, 13, 4]."""
    whole = [Rotation.identity(len(local))] * len(SEGMENTS)
    for joint in range(len(JOINTS)):
        whole[CHILD_SEGMENT[joint]] = whole[PARENT_SEGMENT[joint]] * Rotation.from_quat(local[:, joint])
    return whole


def rendered(
    source: Skeleton, local: Array, camera: Rotation = HERE, *, axes: str | None = None, seed: int = 0
) -> Array:
    """What a sensor sends [frame, joint, 4] xyzw for poses [frame, 13, 4]; joints that drive no segment turn at random.

    `axes` are those that the sensor gives unless said otherwise.
    """
    joint_axes = axes_in_n_pose(source.name)
    whole = body_in_space(local)
    stray = Rotation.random(len(local) * len(source.joints), random_state=seed).as_quat()
    sent = [Rotation.from_quat(turns) for turns in stray.reshape(len(source.joints), len(local), 4)]
    for segment, drive in reversed(list(enumerate(source.drives))):  # where two segments share a drive, the upper one
        if drive is not None:
            sent[drive] = camera * whole[segment] * joint_axes[SEGMENTS[segment]]
    if (axes or source.axes) == "local":
        parents = [HERE if parent == ROOT else sent[parent] for parent in source.parents]
        sent = [above.inv() * turn for above, turn in zip(parents, sent, strict=True)]
    return np.stack([turn.as_quat() for turn in sent], axis=1)


def as_seen(source: Skeleton, local: Array) -> Array:
    """Poses [frame, 13, 4] of a body as coarse as the sensor's: one joint turns the whole trunk where it knows one."""
    poses = local.copy()
    unseen = UNSEEN.get(source.name, set())
    spine, chest = JOINTS.index("spine"), JOINTS.index("chest")
    if "chest" in unseen and "spine" not in unseen:
        poses[:, spine] = (Rotation.from_quat(local[:, spine]) * Rotation.from_quat(local[:, chest])).as_quat()
        poses[:, chest] = [0, 0, 0, 1]
    return poses


@dataclass(frozen=True, slots=True)
class Build:
    """How a body is made: factors of an average one's lengths."""

    height: float = 1.0
    """Of everything."""
    arms: float = 1.0
    legs: float = 1.0
    breadth: float = 1.0
    """Of shoulders and hips."""
    waist: float = 1.0
    """Of the abdomen alone: changes the trunk's proportions."""


BUILDS = (Build(), Build(0.55, 0.9, 0.8, 1.1), Build(1.15, 1.05, 1.1, 0.95), Build(0.9, 1.0, 0.95, 1.3))
"""An average body, a child, a tall one, a broad one."""

_BONES: Mapping[str, tuple[str, str, tuple[float, float, float], str]] = {
    "abdomen": ("", "pelvis", (0, 0.12, 0), "waist"),
    "spine_mid": ("abdomen", "abdomen", (0, 0.14, 0), ""),
    "head": ("spine_mid", "thorax", (0, 0.32, 0), ""),
    "nose": ("head", "head", (0, 0.08, 0.10), ""),
    "l_ear": ("head", "head", (0.07, 0.08, 0), ""),
    "l_shoulder": ("spine_mid", "thorax", (0.18, 0.24, 0), "breadth"),
    "l_elbow": ("l_shoulder", "l_uparm", (0, -0.29, 0), "arms"),
    "l_wrist": ("l_elbow", "l_forearm", (0, -0.26, 0), "arms"),
    "l_index": ("l_wrist", "l_hand", (0, -0.09, 0.03), ""),
    "l_pinky": ("l_wrist", "l_hand", (0, -0.08, -0.03), ""),
    "l_hip": ("", "pelvis", (0.09, -0.03, 0), "breadth"),
    "l_knee": ("l_hip", "l_thigh", (0, -0.43, 0), "legs"),
    "l_ankle": ("l_knee", "l_shank", (0, -0.42, 0), "legs"),
}
"""Point: from which point, with which segment, metres to the left, up, forward, and what scales it beside height."""


def points(local: Array, build: Build = BUILDS[0]) -> dict[str, Array]:
    """Where the points of a body are, [frame, 3] each, in body axes from the middle of the pelvis."""
    whole = body_in_space(local)
    at: dict[str, Array] = {"": np.zeros((len(local), 3))}
    for name, (start, segment, offset, scaled) in _BONES.items():
        factors = np.full(3, build.height)
        if scaled == "breadth":
            factors[0] *= build.breadth
        elif scaled:
            factors *= getattr(build, scaled)
        for side, sign in (("l", 1.0), ("r", -1.0)) if name.startswith("l_") else (("", 1.0),):

            def mine(word: str, side: str = side) -> str:
                return f"{side}{word[1:]}" if word.startswith("l_") else word

            bone = np.array(offset) * factors * [sign, 1.0, 1.0]
            at[mine(name)] = at[mine(start)] + whole[SEGMENTS.index(mine(segment))].apply(bone)
    return {name: at[name] for name in POINTS}


def landmarked(
    source: Landmarks, local: Array, build: Build = BUILDS[0], camera: Rotation = HERE, *, seed: int = 0
) -> Array:
    """What a landmark sensor sends [frame, point, 3] for poses [frame, 13, 4]; points that are not used lie anywhere.

    The camera stands a few units away, a unit being anything from a centimetre to a metre.
    """
    random = np.random.default_rng(seed)
    body = points(local, build)
    sent = random.normal(0.0, 1.0, (len(local), len(source.joints), 3))
    for name, place in source.points.items():
        sent[:, place] = body[name]
    turned = camera.apply(sent.reshape(-1, 3)).reshape(sent.shape)
    return np.asarray((turned + random.uniform(-5.0, 5.0, 3)) * 10.0 ** random.uniform(0.0, 2.0))
