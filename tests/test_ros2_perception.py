"""The core of the ROS node: frames for the service from all that is perceived."""

from typing import Any

import numpy as np
import pytest

from fervor.errors import InputError
from fervor.protocol.messages import Estimate
from fervor.skeletons.ros4hri import ROS4HRI
from fervor_ros import topics
from fervor_ros.human_description import AXES, link_rotations
from fervor_ros.parameters import PARAMETERS, settings_of
from fervor_ros.perception import Perception
from fervor_ros.transforms import Transform

S = 1_000_000_000
NOW = 1_764_115_200_123_456_789
NAMES = [f"{joint}_b1" for joint in AXES]
ANGLES = np.linspace(-0.5, 0.5, len(AXES)).tolist()


def values(**changes: Any) -> dict[str, Any]:
    return {parameter.name: parameter.default for parameter in PARAMETERS} | changes


def perception(**changes: Any) -> Perception:
    return Perception(settings_of(values(**changes)))


def estimate(seq: int, t: float = 0.0) -> Estimate:
    return Estimate(body="b1", seq=seq, t=t, intensity=0.5, level="weak", emotion="joy", status="ok")


def test_a_joint_state_becomes_a_frame() -> None:
    known = perception()
    known.bodies_listed(["b1"], NOW)
    frame = known.joint_states("b1", NAMES, ANGLES, NOW)
    assert (frame.body, frame.t, frame.emotion) == ("b1", NOW / S, "unknown")
    assert np.array_equal(frame.rotations, link_rotations(NAMES, ANGLES, body="b1"))
    assert known.joint_states("b1", NAMES, ANGLES, NOW + 1).seq > frame.seq


def test_rotations_come_in_the_order_of_the_skeleton() -> None:
    known = perception(source="joint_rotations", skeleton="c13")
    turn = (0.0, 0.6, 0.0, 0.8)
    frame = known.joint_rotations(
        "b1", ["r_knee_b1", "spine", "tail", "head"], [turn, (0.0, 0.0, 0.0, 1.0), turn, (np.nan, 0, 0, 1)], NOW
    )
    assert frame.rotations.shape == (13, 4)
    assert tuple(frame.rotations[12]) == turn
    assert tuple(frame.rotations[0]) == (0.0, 0.0, 0.0, 1.0)
    assert np.isnan(frame.rotations[1:12]).all()


def test_transforms_find_their_body_even_if_ids_end_alike() -> None:
    known = perception(source="tf")
    known.bodies_listed(["1", "b_1"], NOW)
    still = np.array([0.0, 0.0, 0.0, 1.0])
    found = [
        frame.body
        for stamp in (NOW, NOW + S // 30)
        for name in ("torso_b_1", "map", "head_1", "torso_2")
        for frame in known.transform(Transform(name, "body", still, stamp))
    ]
    assert found == ["b_1", "b_1", "1", "1"]  # the first pose of each is whole when the second begins


def test_static_frames_count_even_if_their_body_is_listed_later() -> None:
    known = perception(source="tf")
    turn, still = np.array([0.0, 0.6, 0.0, 0.8]), np.array([0.0, 0.0, 0.0, 1.0])
    known.transform(Transform("torso_b1", "waist_b1", still, 0), static=True)
    known.bodies_listed(["b1"], NOW)
    known.transform(Transform("waist_b1", "body_b1", turn, NOW))
    (frame,) = known.transform(Transform("waist_b1", "body_b1", turn, NOW + S // 30))[:1]
    assert frame.rotations[ROS4HRI.joints.index("torso")].tolist() == turn.tolist()


def test_every_frame_bears_the_label_in_force() -> None:
    known = perception(emotion_ttl_s=1.0)
    known.bodies_listed(["b1"], NOW)
    known.persons_listed(["anna"])
    known.matched(topics.BODY_OF_PERSON, "anna", "b1")
    known.matched(topics.FACE_OF_PERSON, "anna", "f1")
    shown = []
    for tenth in range(25):
        stamp = NOW + tenth * S // 10
        if tenth == 5:
            known.expression(topics.FACE_EXPRESSION, "f1", "happy", 0.9, stamp)
        if tenth == 10:
            known.expression(topics.PERSON_EXPRESSION, "anna", "surprised", 0.0, stamp)
        shown.append(known.joint_states("b1", NAMES, ANGLES, stamp).emotion)
    assert shown == ["unknown"] * 5 + ["joy"] * 5 + ["surprise"] * 11 + ["unknown"] * 4


def test_an_unsure_expression_is_passed_over() -> None:
    known = perception(min_confidence=0.5)
    known.bodies_listed(["b1"], NOW)
    known.faces_listed(["f1"])
    known.expression(topics.FACE_EXPRESSION, "f1", "happy", 0.4, NOW)
    assert known.joint_states("b1", NAMES, ANGLES, NOW).emotion == "unknown"
    known.expression(topics.FACE_EXPRESSION, "f1", "happy", 0.0, NOW)  # an analyser that tells no confidence
    assert known.joint_states("b1", NAMES, ANGLES, NOW).emotion == "joy"


def test_an_estimate_finds_its_stamp_to_the_nanosecond() -> None:
    known = perception()
    known.bodies_listed(["b1"], NOW)
    known.persons_listed(["anna"])
    known.matched(topics.BODY_OF_PERSON, "anna", "b1")
    frame = known.joint_states("b1", NAMES, ANGLES, NOW)
    answer = known.answered(estimate(frame.seq, frame.t))
    assert (answer.stamp, answer.person) == (NOW, "anna")
    assert abs(known.answered(estimate(frame.seq, frame.t)).stamp - NOW) < 1000  # by its time, if it comes twice


@pytest.mark.parametrize(
    ("source", "poses"),
    [("joint_states", {topics.JOINT_STATES}), ("joint_rotations", {topics.JOINT_ROTATIONS}), ("tf", set())],
)
def test_it_is_interested_in_those_who_are_there(source: str, poses: set[topics.Topic]) -> None:
    known = perception(source=source, bodies=["b1"])
    assert known.interests == {(topic, "b1") for topic in poses | {topics.INTENSITY}}
    known.persons_listed(["anna"])
    known.matched(topics.FACE_OF_PERSON, "anna", "f1")
    assert {(topics.BODY_OF_PERSON, "anna"), (topics.FACE_OF_PERSON, "anna"), (topics.FACE_EXPRESSION, "f1")} <= (
        known.interests
    )
    known.persons_listed([])
    assert known.interests == {(topic, "b1") for topic in poses | {topics.INTENSITY}}


def test_a_body_that_goes_leaves_its_last_pose() -> None:
    known = perception(source="tf")
    known.bodies_listed(["b1"], NOW)
    known.transform(Transform("torso_b1", "body_b1", np.array([0.0, 0.6, 0.0, 0.8]), NOW))
    known.bodies_listed([], NOW)
    (frame,), gone = known.sweep(NOW + S)
    assert gone == {"b1"}
    assert frame.rotations[ROS4HRI.joints.index("torso")].tolist() == [0.0, 0.6, 0.0, 0.8]
    assert known.transform(Transform("torso_b1", "body_b1", np.zeros(4), NOW + 1)) == []


def test_bodies_without_poses_are_told() -> None:
    known = perception(bodies=["b1", "b2"])
    assert known.silent() == frozenset()  # nobody had the time to move
    known.joint_states("b1", NAMES, ANGLES, NOW)
    assert known.silent() == {"b2"}
    assert known.silent() == {"b1", "b2"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"source": "kinect"},
        {"emotion": "happy"},
        {"emotion_ttl_s": -1.0},
        {"min_confidence": 1.5},
        {"skeleton": "kinect_v2"},
        {"axes": "global"},
    ],
)
def test_parameters_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="expected"):
        settings_of(values(**wrong))


def test_parameters_become_settings() -> None:
    settings = settings_of(values(source="joint_rotations", skeleton="kinect_v2", axes="global", emotion_ttl_s=0.0))
    assert (settings.skeleton.name, settings.axes, settings.emotion_ttl_ns) == ("kinect_v2", "global", None)
    assert settings.bodies == ()
