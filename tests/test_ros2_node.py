"""The ROS node as it is installed, with real topics, a recorded bag and a real service; each in a process of its own.

What it publishes must be what the plain client gets for the same poses: equal to the bit.
"""

import random
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor.skeletons.kinect import KINECT_V2
from fervor.skeletons.rig import JOINTS as RIG_JOINTS
from fervor.skeletons.ros4hri import ROS4HRI
from fervor_client import Estimate, sync
from fervor_ros.human_description import AXES, CHAINS, link_rotations
from live import Live
from pages import ROOT
from stages import RosNode, RosStage, need_ros
from test_proof_resume import served
from waiting import until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(240)]

SAMPLE = ROOT / "service" / "fervor" / "samples" / "joy.bvh"
FIRST = 1_764_115_200_123_456_789
"""Stamp of the first pose, nanoseconds."""
FRAMES = 90
LONG_AGO = -30_000
"""Index of a pose a thousand seconds before the first."""

TRACKED = "/humans/bodies/tracked"
IDS = "hri_msgs/msg/IdsList"
JOINT_STATE = "sensor_msgs/msg/JointState"
ROTATIONS = "sensor_msgs/msg/MultiDOFJointState"
INTENSITY = "fervor_msgs/msg/Intensity"
ANSWERS = "/humans/bodies/b1/intensity"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"

EULER = {"head": "XZY", "l_shoulder": "ZXZ", "r_shoulder": "ZXZ", "l_hip": "ZXY", "r_hip": "ZXY"}
ONE_AXIS = {"torso": "spine", "l_elbow": "l_elbow", "r_elbow": "r_elbow", "l_knee": "l_knee", "r_knee": "r_knee"}


def stamp(index: int) -> int:
    return FIRST + index * 33_333_333


def header(nanoseconds: int, frame: str = "") -> dict[str, Any]:
    return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame}


def nanoseconds(message: dict[str, Any]) -> int:
    told = message["header"]["stamp"]
    return int(told["sec"] * 10**9 + told["nanosec"])


@pytest.fixture(scope="module")
def motion() -> list[dict[str, float]]:
    """Joint angles of a generated motion (the sample that comes with fervor), by the joints of REP-155's human."""
    _, poses, _ = rig_poses(read_recording(SAMPLE))
    return [angles_of(pose) for pose in poses[: 4 * FRAMES : 4]]


def angles_of(pose: np.ndarray) -> dict[str, float]:
    """What a tracker with that human would tell of a pose [13, 4]; it can't tell all of it."""
    in_ros = Rotation.from_quat(pose[:, [2, 0, 1, 3]])  # (left, up, forward) to (forward, left, up)
    angles: dict[str, float] = {}
    for link, chain in CHAINS.items():
        turn = in_ros[RIG_JOINTS.index(ONE_AXIS.get(link, link))]
        axes = [np.array(AXES[joint]) for joint in chain]
        turns = turn.as_euler(EULER[link]) if link in EULER else [turn.as_rotvec() @ np.abs(axes[0])]
        angles |= {joint: float(turn * axis.sum()) for joint, turn, axis in zip(chain, turns, axes, strict=True)}
    return angles


def joint_state(angles: dict[str, float], index: int, body: str = "b1") -> dict[str, Any]:
    return {
        "header": header(stamp(index)),
        "name": [f"{joint}_{body}" for joint in angles],
        "position": list(angles.values()),
    }


def plain(
    url: str, poses: Iterable[Any], *, emotions: Sequence[str] = (), skeleton: str = "ros4hri", met_before: bool = False
) -> list[Estimate]:
    """What the client alone gets; `met_before`: the body was seen long ago, see `acquaint`."""
    with sync.connect(url, skeleton=skeleton) as session:
        for index, pose in enumerate(poses):
            if index == 0 and met_before:
                session.estimate(pose, body="b1", t=stamp(LONG_AGO) / 10**9)
            emotion = emotions[index] if emotions else "unknown"
            session.send(pose, body="b1", t=stamp(index) / 10**9, emotion=emotion)
        session.end()
        return list(session)


def acquaint(stage: RosStage, publish: Callable[[int], None], known: Callable[[dict[str, Any]], bool]) -> None:
    """Poses of long ago, until an answer shows that the node knows what it has to; the gap after them resets the body.

    What comes on other topics is heard by nobody knows when; this waits for it.
    """
    last = LONG_AGO

    def look() -> bool:
        nonlocal last
        last += 1
        publish(last)
        return stage.heard(ANSWERS) and known(stage.hear(ANSWERS))

    until(look)
    publish(last + 1)
    while nanoseconds(stage.hear(ANSWERS)) != stamp(last + 1):
        pass


def links(angles: dict[str, float]) -> np.ndarray:
    return link_rotations(list(angles), list(angles.values()))


def same(told: list[dict[str, Any]], expected: list[Estimate]) -> None:
    """Messages say what estimates say, to the bit, each at the stamp of its pose."""
    assert [nanoseconds(message) for message in told] == [stamp(index) for index in range(len(expected))]
    assert [
        (message["intensity"], message["level"], message["emotion"], message["status"], message["flags"])
        for message in told
    ] == [
        (estimate.intensity, estimate.level, estimate.emotion, estimate.status, list(estimate.flags))
        for estimate in expected
    ]


@pytest.fixture
def stage() -> Iterator[RosStage]:
    need_ros()
    with RosStage() as stage:
        stage.listen(ANSWERS, INTENSITY)
        stage.listen("/diagnostics", DIAGNOSTICS)
        yield stage


def diagnosed(stage: RosStage, **expected: object) -> dict[str, Any]:
    """The next diagnostics in which these values, or the message or level, are so."""

    def look() -> dict[str, Any] | None:
        (status,) = stage.hear("/diagnostics")["status"]
        values = {item["key"]: item["value"] for item in status["values"]}
        known = values | {"message": status["message"], "level": status["level"][0], "name": status["name"]}
        return known if all(known.get(name) == value for name, value in expected.items()) else None

    found: dict[str, Any] = until(look)
    return found


def test_a_bag_of_joint_states_with_a_face_that_shows_joy(
    live: Live, stage: RosStage, motion: list[dict[str, float]], tmp_path: Path
) -> None:
    poses, faces = "/humans/bodies/b1/joint_states", "/humans/faces/f1/expression"
    latched = {
        TRACKED: (IDS, {"header": header(FIRST), "ids": ["b1"]}),
        "/humans/persons/tracked": (IDS, {"header": header(FIRST), "ids": ["p1"]}),
        "/humans/faces/tracked": (IDS, {"header": header(FIRST), "ids": ["f1"]}),
        "/humans/persons/p1/body_id": ("std_msgs/msg/String", {"data": "b1"}),
        "/humans/persons/p1/face_id": ("std_msgs/msg/String", {"data": "f1"}),
    }
    for topic, (kind, _) in latched.items():
        stage.advertise(topic, kind, latched=True)
    stage.advertise(poses, JOINT_STATE)
    stage.advertise(faces, "hri_msgs/msg/Expression")
    stage.record(tmp_path / "bag")
    for index, angles in enumerate(motion):
        if index in (30, 60):
            shown = {"expression": "happy" if index == 30 else "surprised", "confidence": 0.9}
            stage.publish(faces, header=header(stamp(index)), **shown)
        stage.publish(poses, **joint_state(angles, index))
    stage.close_bag()

    for topic, (_, fields) in latched.items():
        stage.publish(topic, **fields)
    with RosNode(stage.domain, service=live.stream):
        stage.await_listener(poses)
        stage.await_listener(faces)

        def sad(index: int) -> None:
            stage.publish(faces, header=header(stamp(index)), expression="sad")
            stage.publish(poses, **joint_state(motion[0], index))

        acquaint(stage, sad, lambda told: told["emotion"] == "sadness")
        stage.play(tmp_path / "bag", poses=poses, answers=ANSWERS)
        told = [stage.hear(ANSWERS) for _ in motion]
    emotions = [message["emotion"] for message in told]
    assert emotions == sorted(emotions, key=["unknown", "joy", "surprise"].index)
    assert set(emotions) == {"unknown", "joy", "surprise"}  # each has come, at whatever frame DDS let it pass
    same(told, plain(live.stream, map(links, motion), emotions=emotions, met_before=True))
    assert {(message["body_id"], message["person_id"], message["header"]["frame_id"]) for message in told} == {
        ("b1", "p1", "body_b1")
    }
    assert all(message["demo"] for message in told)


def test_frames_of_tf(live: Live, stage: RosStage, motion: list[dict[str, float]]) -> None:
    stage.advertise("/tf", "tf2_msgs/msg/TFMessage")
    stage.advertise("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
    stage.advertise(TRACKED, IDS, latched=True)
    stage.publish(TRACKED, ids=["b1"])
    fixed = [transform("torso", "waist", [0, 0, 0, 1], 0), transform("head", "p_head", [0, 0, 0, 1], 0)]
    stage.publish("/tf_static", transforms=fixed)
    expected, told = [], []
    with RosNode(stage.domain, service=live.stream, source="tf"):
        stage.await_listener("/tf_static")
        stage.await_listener("/tf")
        acquaint(
            stage,
            lambda index: stage.publish("/tf", transforms=frames_of(motion[0], index)[0]),
            lambda told: bool(told["status"] != "insufficient"),  # without the fixed frames, trunk and head are unseen
        )
        for index, angles in enumerate(motion):
            frames, pose = frames_of(angles, index)
            stage.publish("/tf", transforms=frames)
            expected.append(pose)
            if index >= 16:  # no more than the queues on the way hold
                told.append(stage.hear(ANSWERS))
        told += [stage.hear(ANSWERS) for _ in range(16)]
    same(told, plain(live.stream, expected, met_before=True))


def transform(link: str, parent: str, rotation: Sequence[float], index: int) -> dict[str, Any]:
    x, y, z, w = map(float, rotation)
    return {
        "header": header(stamp(index), f"{parent}_b1"),
        "child_frame_id": f"{link}_b1",
        "transform": {"rotation": {"x": x, "y": y, "z": z, "w": w}},
    }


def frames_of(angles: dict[str, float], index: int) -> tuple[list[dict[str, Any]], np.ndarray]:
    """A tracker without all of the URDF: its frames are the links. And the pose."""
    pose = links(angles)
    frames = [
        transform(
            {"torso": "waist", "head": "p_head"}.get(link, link),
            ROS4HRI.joints[ROS4HRI.parents[joint]],
            pose[joint],
            index,
        )
        for joint, link in enumerate(ROS4HRI.joints)
        if joint
    ]
    return frames, pose


def test_rotations_of_a_kinect_while_the_service_is_killed(live: Live, stage: RosStage) -> None:
    """The node goes on by itself, and nothing of what it publishes differs."""
    joints = list(KINECT_V2.joints)
    dice = np.random.default_rng(3)
    poses = Rotation.from_rotvec(np.cumsum(dice.normal(0, 0.03, (FRAMES, 25, 3)), axis=0).reshape(-1, 3)).as_quat()
    poses = poses.reshape(FRAMES, 25, 4)
    topic = "/humans/bodies/b1/joint_rotations"
    stage.advertise(topic, ROTATIONS)
    kinect = {"source": "joint_rotations", "skeleton": "kinect_v2", "bodies": ["b1"], "emotion": "joy"}
    told: list[dict[str, Any]] = []

    def stream(begin: int, end: int) -> None:
        for index in range(begin, end):
            turns = [{"rotation": dict(zip("xyzw", map(float, turn), strict=True))} for turn in poses[index]]
            stage.publish(topic, header=header(stamp(index)), joint_names=joints, transforms=turns)

    with served("0") as (process, port), RosNode(stage.domain, service=f"ws://127.0.0.1:{port}", **kinect):
        stage.await_listener(topic)
        stream(0, 50)
        told += [stage.hear(ANSWERS) for _ in range(50)]
        process.kill()
        process.wait()
        stream(50, 70)
        diagnosed(stage, level=1)
        with served(port):
            stream(70, FRAMES)
            told += [stage.hear(ANSWERS) for _ in range(FRAMES - 50)]
    same(told, plain(live.stream, poses, skeleton="kinect_v2", emotions=["joy"] * FRAMES))


def test_bodies_come_and_go_and_a_bad_name_harms_nobody(
    live: Live, stage: RosStage, motion: list[dict[str, float]]
) -> None:
    stage.listen("/humans/bodies/b2/intensity", INTENSITY)
    stage.advertise(TRACKED, IDS)  # not latched: the node has to be content with that
    for body in ("b1", "b2"):
        stage.advertise(f"/humans/bodies/{body}/joint_states", JOINT_STATE, best_effort=body == "b2")
    with RosNode(stage.domain, service=live.stream, body_grace_s=0.2) as node:
        stage.await_listener(TRACKED)
        stage.publish(TRACKED, ids=["b1", "not a name", "b2"])
        for body in ("b1", "b2"):
            stage.await_listener(f"/humans/bodies/{body}/joint_states")
            assert answer(stage, body, motion[0])["body_id"] == body
        stage.publish(TRACKED, ids=["b1"])
        diagnosed(stage, bodies="1")
        assert answer(stage, "b1", motion[1], first=1000)["body_id"] == "b1"
        stage.publish(TRACKED, ids=["b1", "b2"])
        stage.await_listener("/humans/bodies/b2/joint_states")
        again = answer(stage, "b2", motion[2], first=1000)
        assert again["status"] == "warming_up"
        assert "late" not in again["flags"]
    assert sum("not a name" in line for line in node.complaints) == 1, node.complaints


def answer(stage: RosStage, body: str, angles: dict[str, float], *, first: int = 0) -> dict[str, Any]:
    """The answer to one of several poses of a body, from index `first` on: of best effort some may be lost."""
    indices, topic = count(first), f"/humans/bodies/{body}/intensity"

    def look() -> dict[str, Any] | None:
        stage.publish(f"/humans/bodies/{body}/joint_states", **joint_state(angles, next(indices), body))
        told = stage.hear(topic) if stage.heard(topic) else None
        return told if told is not None and nanoseconds(told) >= stamp(first) else None

    found: dict[str, Any] = until(look)
    return found


def test_simulated_time_and_poses_without_a_stamp(live: Live, stage: RosStage, motion: list[dict[str, float]]) -> None:
    stage.advertise("/clock", "rosgraph_msgs/msg/Clock")
    stage.advertise("/humans/bodies/b1/joint_states", JOINT_STATE)
    with RosNode(stage.domain, service=live.stream, bodies=["b1"], use_sim_time=True, diagnostics_period_s=0.1):
        stage.await_listener("/clock")
        stage.await_listener("/humans/bodies/b1/joint_states")
        ticks, least = iter(range(1000, 100_000)), 0

        def follows() -> bool:
            """Whether the node's clock is the simulated one."""
            nonlocal least
            stage.publish("/clock", clock={"sec": next(ticks)})
            least = nanoseconds(stage.hear("/diagnostics")) if stage.heard("/diagnostics") else 0
            return 1000 * 10**9 <= least < 100_000 * 10**9

        until(follows)
        unstamped = joint_state(motion[0], 0) | {"header": header(0)}
        stage.publish("/humans/bodies/b1/joint_states", **unstamped)
        told = stage.hear(ANSWERS)
    assert least <= nanoseconds(told) < next(ticks) * 10**9


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_it_says_how_it_fares_and_ends_when_told(stage: RosStage, sign: signal.Signals) -> None:
    config = ROOT / "clients" / "ros2" / "fervor_ros" / "config" / "fervor.yaml"
    with served("0") as (process, port):
        process.kill()
        process.wait()
        with RosNode(stage.domain, "--params-file", str(config), service=f"ws://127.0.0.1:{port}") as node:
            diagnosed(stage, name="fervor: service", level=2)
            with served(port):
                diagnosed(stage, message="streaming to a demo model", level=0, bodies="0")
                assert node.end(sign) == 0
    assert not any("Traceback" in line for line in node.complaints), node.complaints


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"source": "kinect"}, "parameter source is 'kinect'; expected one of joint_states"),
        ({"emotion_ttl_s": 2}, "emotion_ttl_s"),  # not 2.0
        ({"min_confidence": 1.5}, "min_confidence"),
        ({"humans": "/no name"}, "/no name"),
    ],
)
def test_parameters_that_cannot_be_end_it_with_a_sentence(wrong: dict[str, Any], told: str) -> None:
    need_ros()
    with RosNode(random.randrange(1, 102), **wrong) as node:
        assert node.process.wait(60) == 65
    (complaint,) = [line for line in node.complaints if line.startswith("fervor_node: ")]
    assert told in complaint
    assert not any("Traceback" in line for line in node.complaints)
