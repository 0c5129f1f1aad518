"""The main job on real motion: one file through every door, against scipy and torch, which know none of our code.

The reference reads the BVH by itself, composes rotations with scipy as the skeleton tables say, puts them on a 30 Hz
grid with scipy's SLERP, and runs the torch network of the packaged model file over the whole sequence.
"""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation, Slerp

import fervor_client
from bodies import model
from fervor.emotions import emotion_vector
from fervor.model import default_model_path
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor_export.weights import network_from_model_file
from program import fervor

FILES = [
    "100style/angry_reference.bvh",
    "100style/elated_reference.bvh",
    "100style/rushed_reference.bvh",
    "cmu/79_69.bvh",
    "cmu/79_70.bvh",
    "cmu/79_71.bvh",
]
RATE = 30.0
T = {"l": Rotation.from_euler("Z", 90, degrees=True), "r": Rotation.from_euler("Z", -90, degrees=True)}
# Rig joint → the file's joints whose product it is; both kinds of file have a T-pose for their zero pose.
EBMDB = {
    "spine": "Chest Chest2", "chest": "Chest3 Chest4", "head": "Neck Head",
    "{s}_shoulder": "{S}Collar {S}Shoulder", "{s}_elbow": "{S}Elbow", "{s}_wrist": "{S}Wrist",
    "{s}_hip": "{S}Hip", "{s}_knee": "{S}Knee",
}  # fmt: skip
CMU = {
    "spine": "LowerBack Spine", "chest": "Spine1", "head": "Neck Neck1 Head",
    "{s}_shoulder": "{S}Shoulder {S}Arm", "{s}_elbow": "{S}ForeArm", "{s}_wrist": "{S}Hand",
    "{s}_hip": "{L}HipJoint {S}UpLeg", "{s}_knee": "{S}Leg",
}  # fmt: skip
ORDER = [
    "spine", "chest", "head", "l_shoulder", "l_elbow", "l_wrist", "r_shoulder", "r_elbow", "r_wrist",
    "l_hip", "l_knee", "r_hip", "r_knee",
]  # fmt: skip


def channels(path: Path) -> tuple[dict[str, Rotation], np.ndarray]:
    """Each joint's local rotation over all frames, and the times."""
    header, motion = path.read_text().split("MOTION")
    joints: dict[str, list[str]] = {}
    for line in header.splitlines():
        words = line.split()
        if words and words[0] in {"ROOT", "JOINT"}:
            joints[words[1]] = []
        elif words and words[0] == "CHANNELS":
            joints[list(joints)[-1]] = words[2:]
    lines = motion.strip().splitlines()
    step = float(lines[1].split(":")[1])
    values = np.array([[float(word) for word in line.split()] for line in lines[2:]])
    turns, at = {}, 0
    for joint, names in joints.items():
        columns = {name: values[:, at + place] for place, name in enumerate(names)}
        at += len(names)
        order = "".join(name[0] for name in names if name.endswith("rotation"))
        angles = np.stack([columns[f"{axis}rotation"] for axis in order], axis=1)
        turns[joint] = Rotation.from_euler(order, angles, degrees=True)
    return turns, np.arange(len(values)) * step


def canonical(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Rig rotations [frame, 13, 4] and times [frame], by scipy alone."""
    turns, times = channels(path)
    table = EBMDB if path.parent.name == "100style" else CMU
    local = {}
    for joint, chain in table.items():
        for s, side in (("l", "Left"), ("r", "Right")) if "{s}" in joint else (("", ""),):
            product = Rotation.identity(len(times))
            for name in chain.format(S=side, L=side[:1]).split():
                product = product * turns[name]
            if joint.endswith("shoulder"):
                product = product * T[s]
            elif joint.endswith(("elbow", "wrist")):
                product = T[s].inv() * product * T[s]
            local[joint.format(s=s)] = product.as_quat()
    return np.stack([local[joint] for joint in ORDER], axis=1), times


def by_torch(rotations: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Intensities [grid step] of the torch network over a whole 30 Hz sequence."""
    grid = np.arange(int((times[-1] - times[0] + 1e-6) * RATE) + 1) / RATE
    slerps = [Slerp(times, Rotation.from_quat(rotations[:, joint])) for joint in range(13)]
    poses = np.stack([slerp(np.minimum(grid, times[-1])).as_quat() for slerp in slerps], axis=1)
    steps = len(poses)
    network = network_from_model_file(default_model_path()).eval()
    with torch.no_grad():
        output = network(
            torch.from_numpy(poses[None].astype(np.float32)),
            torch.ones(1, steps, 13),
            torch.from_numpy(np.tile(emotion_vector("joy"), (1, steps, 1))),
        )
    return output.intensity[0].numpy()


@pytest.mark.parametrize("name", FILES)
def test_poses_are_those_of_scipy(shared_data, name):
    expected, times = canonical(shared_data / name)
    got_times, got, observed = rig_poses(read_recording(shared_data / name))
    assert observed.all()
    assert np.allclose(got_times, times, atol=1e-9)
    assert (
        Rotation.from_quat(got.reshape(-1, 4)).inv() * Rotation.from_quat(expected.reshape(-1, 4))
    ).magnitude().max() < 1e-6


@pytest.mark.parametrize("name", FILES)
def test_every_door_gives_what_torch_gives_on_scipys_poses(shared_data, live, http, name):
    path = shared_data / name
    rotations, times = canonical(path)
    expected = by_torch(rotations, times)

    options = {"emotion": "joy", "memory": "stateful", "detail": "frames", "filename": path.name}
    (scored,) = http.post("/v1/score/file", params=options, content=path.read_bytes()).json()["sequences"]
    by_http = [estimate["intensity"] for estimate in scored["estimates"]]

    with fervor_client.sync.connect(live.stream, emotion="joy", memory="stateful") as session:
        for pose, time in zip(rotations, times, strict=True):
            session.send(pose, t=float(time))
        session.end()
        by_stream = [estimate.intensity for estimate in session]

    done = fervor(
        "stream", str(path), "--emotion", "joy", "--memory", "stateful", "--fast", "--json", "--url", live.stream
    )
    by_command = [json.loads(line)["intensity"] for line in done.stdout.splitlines()]

    done = fervor("score", str(path), "--emotion", "joy", "--memory", "stateful", "--frames", "--json")
    by_score = [estimate["intensity"] for estimate in json.loads(done.stdout)["sequences"][0]["estimates"]]

    assert len(by_http) == len(by_stream) == len(by_command) == len(by_score) == len(times)
    for other in (by_stream, by_command, by_score):
        assert np.abs(np.array(other) - by_http).max() <= 1e-6
    # A frame speaks for the newest grid step at or before it.
    newest = np.floor((times - times[0] + 1e-6) * RATE).astype(int)
    assert np.abs(expected[newest] - by_http).max() <= 1e-5


def test_real_motion_moves_the_demo_model(shared_data):
    """Neither constant nor saturated, on any file, whatever the emotion."""
    for name in FILES:
        rotations, times = canonical(shared_data / name)
        poses = rotations[:: round(1 / (np.median(np.diff(times)) * RATE))].astype(np.float32)[None]
        outputs = model().run(
            poses,
            np.ones(poses.shape[:3], np.float32),
            np.zeros((1, poses.shape[1], 11), np.float32),
            model().zero_states(1),
        )
        settled = outputs.intensity_by_emotion[0, 30:]
        assert settled.std(axis=0).max() > 0.01, name
        assert 0.02 < np.median(settled) < 0.98, name
