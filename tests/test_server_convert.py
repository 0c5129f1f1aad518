"""Recordings on the rig, for programs without readers of their own."""

import json

import httpx
import numpy as np
import pytest

from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from live import Live
from program import write_bvh


def test_a_recording_comes_back_on_the_rig_to_the_bit(tmp_path, http: httpx.Client) -> None:
    path = write_bvh(tmp_path / "wave.bvh", seconds=0.5)
    answer = http.post("/v1/convert", params={"filename": "wave.bvh"}, content=path.read_bytes())
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/jsonl"
    head, *frames = map(json.loads, answer.text.splitlines())
    times, local, observed = rig_poses(read_recording(path))
    assert head["skeleton"] == "c13"
    assert [frame["t"] for frame in frames] == times.tolist()
    for frame, pose, seen in zip(frames, local, observed, strict=True):
        assert [joint is not None for joint in frame["q"]] == seen.tolist()
        assert np.array_equal([joint for joint in frame["q"] if joint], pose[seen])


def test_a_table_is_told_what_its_joints_are(http: httpx.Client) -> None:
    points = json.dumps({"t": 0.0, "p": [[0.0, 1.0, 0.0]] * 33}).encode()
    answer = http.post("/v1/convert", params={"filename": "a.jsonl", "skeleton": "mediapipe"}, content=points)
    assert answer.status_code == 200
    assert len(answer.text.splitlines()) == 2


def test_what_is_no_recording_is_refused(http: httpx.Client) -> None:
    answer = http.post("/v1/convert", params={"filename": "notes.txt"}, content=b"dear diary")
    assert answer.status_code == 422
    assert answer.json()["detail"] == "notes.txt: not a recording; expected BVH, MVNX, CSV, JSONL or NPZ"


@pytest.mark.parametrize("setting", [{"score_max_frames": 3}, {"score_max_bytes": 1024}])
def test_a_recording_may_be_so_long(setting, tmp_path, start_service) -> None:
    live: Live = start_service(**setting)
    content = write_bvh(tmp_path / "wave.bvh", seconds=1.0).read_bytes()
    answer = httpx.post(f"{live.url}/v1/convert", params={"filename": "wave.bvh"}, content=content, timeout=60)
    assert answer.status_code == 413
    assert answer.json()["code"] == "too_large"
