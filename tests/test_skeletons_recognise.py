"""Skeletons of unknown files: segments from names, bind alignment from offsets."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import InputError
from fervor.rotations import IDENTITY
from fervor.skeletons.adapter import adapt
from fervor.skeletons.binds import T_POSE
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.naming import REQUIRED
from fervor.skeletons.recognise import recognise
from fervor.skeletons.rig import JOINTS, SEGMENTS
from fervor.skeletons.skeleton import Skeleton

Array = npt.NDArray[np.float64]
TREE = (-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 0, 17, 18)
"""hips, three of the spine, neck, head, two arms of four, two legs of three."""
ROLES = [
    "pelvis", "spine0", "abdomen", "thorax", "neck", "head",
    "l_clavicle", "l_uparm", "l_forearm", "l_hand", "r_clavicle", "r_uparm", "r_forearm", "r_hand",
    "l_thigh", "l_shank", "l_foot", "r_thigh", "r_shank", "r_foot",
]  # fmt: skip
NAMINGS = {
    "mixamo": "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head "
    "mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand mixamorig:RightShoulder "
    "mixamorig:RightArm mixamorig:RightForeArm mixamorig:RightHand mixamorig:LeftUpLeg mixamorig:LeftLeg "
    "mixamorig:LeftFoot mixamorig:RightUpLeg mixamorig:RightLeg mixamorig:RightFoot",
    "neuron": "Hips Spine Spine1 Spine2 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm "
    "RightForeArm RightHand LeftUpLeg LeftLeg LeftFoot RightUpLeg RightLeg RightFoot",
    "lower": "hips spine spine1 spine2 neck head leftshoulder leftarm leftforearm lefthand rightshoulder rightarm "
    "rightforearm righthand leftupleg leftleg leftfoot rightupleg rightleg rightfoot",
    "upper": "HIPS SPINE CHEST CHEST_UPPER NECK HEAD COLLAR_LEFT SHOULDER_LEFT ELBOW_LEFT WRIST_LEFT COLLAR_RIGHT "
    "SHOULDER_RIGHT ELBOW_RIGHT WRIST_RIGHT HIP_LEFT KNEE_LEFT ANKLE_LEFT HIP_RIGHT KNEE_RIGHT ANKLE_RIGHT",
    "unreal": "pelvis spine_01 spine_02 spine_03 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l clavicle_r "
    "upperarm_r lowerarm_r hand_r thigh_l calf_l foot_l thigh_r calf_r foot_r",
    "poser": "hip abdomen abdomen2 chest neck head lCollar lShldr lForeArm lHand rCollar rShldr rForeArm rHand lThigh "
    "lShin lFoot rThigh rShin rFoot",
    "blender": "hips spine spine.001 spine.002 spine.003 head shoulder.L upper_arm.L forearm.L hand.L shoulder.R "
    "upper_arm.R forearm.R hand.R thigh.L shin.L foot.L thigh.R shin.R foot.R",
    "vrm": "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head J_Bip_L_Shoulder "
    "J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_R_Shoulder J_Bip_R_UpperArm J_Bip_R_LowerArm J_Bip_R_Hand "
    "J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_R_UpperLeg J_Bip_R_LowerLeg J_Bip_R_Foot",
    "smpl": "Pelvis Spine1 Spine2 Spine3 Neck Head L_Collar L_Shoulder L_Elbow L_Wrist R_Collar R_Shoulder R_Elbow "
    "R_Wrist L_Hip L_Knee L_Ankle R_Hip R_Knee R_Ankle",
    "mocopi": "root torso_1 torso_3 torso_7 neck_1 head l_shoulder l_up_arm l_low_arm l_hand r_shoulder r_up_arm "
    "r_low_arm r_hand l_up_leg l_low_leg l_foot r_up_leg r_low_leg r_foot",
    "one word": "hip spine chest upperchest neck head lclavicle lshoulder lelbow lwrist rclavicle rshoulder relbow "
    "rwrist lhip lknee lankle rhip rknee rankle",
}


def offsets_for(arm: tuple[float, float, float] = (1.0, 0.0, 0.0), turn: Rotation | None = None) -> Array:
    """Offsets of `TREE` with the left arm along `arm`, the right one mirrored, the whole body turned."""
    left = [[size * part for part in arm] for size in (30, 25)]
    right = [[-x, y, z] for x, y, z in left]
    rows = [
        [0, 90, 0], [0, 10, 0], [0, 10, 0], [0, 10, 0], [0, 20, 0], [0, 10, 0],
        [3, 15, 0], [15, 0, 0], left[0], left[1], [-3, 15, 0], [-15, 0, 0], right[0], right[1],
        [9, -2, 0], [0, -40, 0], [0, -40, 0], [-9, -2, 0], [0, -40, 0], [0, -40, 0],
    ]  # fmt: skip
    table = np.array(rows, np.float64)
    return table if turn is None else turn.apply(table)


def same(a: Array, b: Array, tolerance: float = 1e-12) -> bool:
    return bool(np.all(np.minimum(np.abs(a - b).max(-1), np.abs(a + b).max(-1)) < tolerance))


def roles(source: Skeleton) -> dict[str, str]:
    return {s: ROLES[drive] for s, drive in zip(SEGMENTS, source.drives, strict=True) if drive is not None}


@pytest.mark.parametrize("naming", NAMINGS)
def test_common_names_are_understood(naming: str) -> None:
    source = recognise(NAMINGS[naming].split(), TREE, offsets_for())
    assert roles(source) == {segment: segment for segment in SEGMENTS}


def test_names_with_spaces_and_helper_bones() -> None:
    tree = {
        "Bip01": -1, "Bip01 Pelvis": 0, "Bip01 Spine": 1, "Bip01 L Thigh": 2, "Bip01 L Calf": 3, "Bip01 R Thigh": 2,
        "Bip01 R Calf": 5, "Bip01 Spine1": 2, "Bip01 Neck": 7, "Bip01 Head": 8, "Bip01 L Clavicle": 8,
        "Bip01 L UpperArm": 10, "Bip01 L ForeTwist": 11, "Bip01 L Forearm": 11, "Bip01 L Hand": 13,
        "Bip01 R Clavicle": 8, "Bip01 R UpperArm": 15, "Bip01 R Forearm": 16, "Bip01 R Hand": 17, "ik_hand_l": 0,
    }  # fmt: skip
    source = recognise(list(tree), list(tree.values()), np.zeros((len(tree), 3)))
    names = {s: source.joints[d] for s, d in zip(SEGMENTS, source.drives, strict=True) if d is not None}
    assert names["pelvis"] == "Bip01 Pelvis"
    assert names["thorax"] == "Bip01 Neck"  # 3ds Max hangs the arms there
    assert names["l_hand"] == "Bip01 L Hand"
    assert names["l_thigh"] == "Bip01 L Thigh"
    assert names["head"] == "Bip01 Head"


@pytest.mark.parametrize("name", ["ebmdb", "cmu"])
def test_known_names_give_the_joints_of_the_catalogue(name: str) -> None:
    known = skeleton(name)
    found = recognise(known.joints, known.parents, np.zeros((len(known.joints), 3)))
    assert found.drives == known.drives
    assert f"named as {name}" in found.title


@pytest.mark.parametrize(
    ("arm", "angle", "letter"),
    [
        ((0.0, -1.0, 0.0), 0.0, "N"),
        ((1.0, 0.0, 0.0), 90.0, "T"),
        ((0.999, 0.02, 0.02), 90.0, "T"),
        ((0.02, -0.999, 0.02), 0.0, "N"),
        ((1.0, -1.0, 0.0), 45.0, "A"),
        ((0.5, -np.sqrt(0.75), 0.0), 30.0, "A"),
    ],
)
def test_the_zero_pose_comes_from_the_offsets(arm: tuple[float, float, float], angle: float, letter: str) -> None:
    source = recognise(NAMINGS["neuron"].split(), TREE, offsets_for(arm))
    for segment, bind in zip(SEGMENTS, source.bind, strict=True):
        sign = {"l": 1, "r": -1}.get(segment[0], 0) if segment in T_POSE else 0
        assert same(bind, Rotation.from_euler("z", -sign * angle, degrees=True).as_quat())
    assert source.title.endswith(f"zero pose {letter})")


@pytest.mark.parametrize(
    "arm", [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (1.0, -1.0, 0.0), (0.3, -0.8, 0.4), (0.0, 1.0, 0.0)]
)
@pytest.mark.parametrize("turn", [(0, 0, 0), (90, 0, 0), (0, 180, 0), (0, 90, 0), (-90, 0, 180)])
def test_hanging_arms_give_the_identity_whatever_zero_pose_and_axes(
    arm: tuple[float, float, float], turn: tuple[float, float, float]
) -> None:
    """Put the body of the file into an N-pose with plain bone directions; the rig must see the identity."""
    axes = Rotation.from_euler("xyz", turn, degrees=True)
    source = recognise(NAMINGS["neuron"].split(), TREE, offsets_for(arm, axes))
    rotations = np.tile(IDENTITY, (len(TREE), 1))
    for side, sign in (("l", 1.0), ("r", -1.0)):
        direction = np.array([sign * arm[0], arm[1], arm[2]]) / np.linalg.norm(arm)
        axis = np.cross(direction, [0, -1, 0])
        sine, cosine = np.linalg.norm(axis), -direction[1]
        axis = axis / sine if sine > 1e-9 else np.array([0.0, 0.0, 1.0])
        hang = Rotation.from_rotvec(axis * np.arctan2(sine, cosine))
        rotations[ROLES.index(f"{side}_uparm")] = (axes * hang * axes.inv()).as_quat()
    local, observed = adapt(source, rotations, np.ones(len(TREE), np.bool_), axes="local")
    assert observed.all()
    assert same(local, np.tile(IDENTITY, (13, 1)), 1e-9)


def test_a_map_of_segments_wins_over_names() -> None:
    names = [f"bone{index}" for index in range(len(TREE))]
    with pytest.raises(InputError, match="no joint was found for thorax, l_uparm, l_forearm, r_uparm, r_forearm"):
        recognise(names, TREE, offsets_for())
    arms = {role: names[ROLES.index(role)] for role in REQUIRED if role != "thorax"}
    source = recognise(names, TREE, offsets_for(), segments=arms)
    assert roles(source) == {
        **{role: role for role in REQUIRED}, "pelvis": "pelvis", "abdomen": "abdomen",
    }  # fmt: skip
    legs = {"l_thigh": names[14], "r_thigh": names[17], "head": names[5]}
    assert sum(recognise(names, TREE, offsets_for(), segments={**arms, **legs}).sees) == 9
    named = NAMINGS["neuron"].split()
    source = recognise(named, TREE, offsets_for(), segments={"head": "Neck", "l_hand": None, "abdomen": "Spine"})
    assert roles(source)["head"] == "neck"
    assert roles(source)["abdomen"] == "spine0"
    assert "l_hand" not in roles(source)


def test_unfound_segments_are_masked() -> None:
    names = NAMINGS["neuron"].split()[:14]
    names[5], names[9], names[13] = "Crown", "Mitten.L", "Mitten.R"
    names[4] = "Throat"
    source = recognise(names, TREE[:14], offsets_for()[:14])
    unseen = {joint for joint, seen in zip(JOINTS, source.sees, strict=True) if not seen}
    assert unseen == {"head", "l_wrist", "r_wrist", "l_hip", "l_knee", "r_hip", "r_knee"}


def test_one_joint_of_the_spine_is_the_spine_and_leaves_the_chest_unseen() -> None:
    names = ["Hips", "Chest", "Head", "LeftArm", "LeftForeArm", "RightArm", "RightForeArm"]
    source = recognise(names, (-1, 0, 1, 1, 3, 1, 5), np.zeros((7, 3)))
    seen = dict(zip(JOINTS, source.sees, strict=True))
    assert seen["spine"]
    assert not seen["chest"]


def test_wrong_maps_are_refused() -> None:
    names = NAMINGS["neuron"].split()
    with pytest.raises(InputError, match="segment 'tail' is not known; expected one of pelvis"):
        recognise(names, TREE, offsets_for(), segments={"tail": "Hips"})
    with pytest.raises(InputError, match="names the joint 'Tail'; expected one of Hips"):
        recognise(names, TREE, offsets_for(), segments={"head": "Tail"})


def test_a_missing_arm_is_named() -> None:
    names = NAMINGS["neuron"].split()
    names[12] = "Sausage"
    with pytest.raises(InputError, match=r"no joint was found for r_forearm among .* map of segments.*'r_forearm'"):
        recognise(names, TREE, offsets_for())


def test_the_catalogue_names_itself() -> None:
    assert all(known.name == name for name, known in SKELETONS.items())
    assert skeleton(" EBMDB ") is SKELETONS["ebmdb"]
    with pytest.raises(InputError, match="skeleton 'kinect9' is not known; expected one of c13, kinect_v2, "):
        skeleton("kinect9")


@pytest.mark.parametrize("known", SKELETONS.values(), ids=SKELETONS.keys())
def test_the_catalogue_is_sound(known: Skeleton) -> None:
    assert len(set(known.joints)) == len(known.joints)
    assert all(parent < len(known.joints) for parent in known.parents)
    assert np.allclose(np.linalg.norm(known.bind, axis=-1), 1.0, atol=1e-15)
    assert known.title
    for joint in range(len(known.joints)):  # no cycles
        seen = set()
        while joint >= 0:
            assert joint not in seen
            seen.add(joint)
            joint = known.parents[joint]  # noqa: PLW2901
