"""Scoring over HTTP: the numbers of the stream, limits, and every way to get it wrong."""

import asyncio
import json
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import msgpack
import numpy as np
import pytest

from bodies import motion
from fervor.model import default_model_path
from fervor.recordings.recording import Recording
from fervor.recordings.writer import write_recording
from fervor.skeletons.canonical import C13
from fervor.skeletons.rig import JOINTS
from live import Live, bare, frames_of, score, score_request, talk
from waiting import until

FRAMES = frames_of(motion(150))
SHORT = score_request(FRAMES[:3])
MANNERS = [
    {"clock": "frames"},
    {"clock": "frames", "nominal_hz": 50},
    {"memory": "stateful"},
    {"memory": "window"},
    {"skeleton": "c13", "joints": list(JOINTS[::-1])},
    {"quaternion": "wxyz"},
]

BVH = """HIERARCHY
ROOT Hips {{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
 JOINT Chest {{ OFFSET 0 20 0 CHANNELS 3 Zrotation Yrotation Xrotation
{arms} }}
 JOINT LeftHip {{ OFFSET 8 0 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site {{ OFFSET 0 -40 0 }} }}
 JOINT RightHip {{ OFFSET -8 0 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site {{ OFFSET 0 -40 0 }} }} }}
MOTION
Frames: {frames}
Frame Time: 0.0166667
{rows}
"""

ARM = """  JOINT {side}Shoulder {{ OFFSET {x} 15 0 CHANNELS 3 Zrotation Yrotation Xrotation
   JOINT {side}Elbow {{ OFFSET 0 -30 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site {{ OFFSET 0 -25 0 }} }} }}"""


def bvh(frames: int) -> str:
    """A small file of somebody waving the left arm."""
    arms = "\n".join(ARM.format(side=side, x=x) for side, x in (("Left", 15), ("Right", -15)))
    rows = "\n".join(" ".join(["0"] * 9 + [str(40 * (n % 20)), "10"] + ["0"] * 16) for n in range(frames))
    return BVH.format(arms=arms, frames=frames, rows=rows)


@pytest.fixture
def strict(start_service) -> Iterator[httpx.Client]:
    """HTTP to a service that takes little."""
    service = start_service(score_max_bytes=20_000, score_max_frames=10, score_max_sequences=2)
    with httpx.Client(base_url=service.url, timeout=60) as client:
        yield client


async def test_a_score_is_what_a_stream_would_have_said(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="joy", by_emotion=True)
        streamed = await stream.follow(FRAMES)
    (scored,) = await score(live, score_request(FRAMES, name="walk", emotion="joy", by_emotion=True))
    assert bare(scored["estimates"]) == bare(streamed)


@pytest.mark.parametrize("manner", MANNERS)
async def test_so_it_is_in_every_manner(manner: dict, live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="sad", **manner)
        streamed = await stream.follow(FRAMES)
    (scored,) = await score(live, score_request(FRAMES, emotion="sad", **manner))
    assert bare(scored["estimates"]) == bare(streamed)


async def test_raw_joints_in_messagepack_are_what_a_stream_would_have_said(live: Live) -> None:
    single = np.float32(motion(150))
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        streamed = await stream.follow(frames_of(np.float64(single)))
    frames = [{"t": n / 60, "q": pose.astype("<f4").tobytes()} for n, pose in enumerate(single)]
    request = score_request(frames, emotion="joy")
    async with httpx.AsyncClient(base_url=live.url, timeout=60) as client:
        content = {"content": msgpack.packb(request), "headers": {"content-type": "application/msgpack"}}
        answer = await client.post("/v1/score", **content)
    assert answer.status_code == 200, answer.text
    assert bare(answer.json()["sequences"][0]["estimates"]) == bare(streamed)


def test_neighbours_in_a_request_change_no_bit(http: httpx.Client) -> None:
    alone = http.post("/v1/score", json=score_request(FRAMES, name="a", emotion="joy")).json()["sequences"]
    several = score_request(FRAMES, name="a", emotion="joy")
    for seed in range(1, 4):
        several["sequences"] += score_request(frames_of(motion(40 * seed, seed=seed)), name=str(seed))["sequences"]
    together = http.post("/v1/score", json=several).json()["sequences"]
    assert [scored["name"] for scored in together] == ["a", "1", "2", "3"]
    assert [scored["frames"] for scored in together] == [150, 40, 80, 120]
    assert together[0] == alone[0]


def test_a_summary_says_little(http: httpx.Client) -> None:
    detailed = http.post("/v1/score", json=score_request(FRAMES, emotion="joy")).json()["sequences"][0]
    answer = http.post("/v1/score", json={**score_request(FRAMES, emotion="joy"), "detail": "summary"}).json()
    (scored,) = answer["sequences"]
    settled = [estimate["intensity"] for estimate in detailed["estimates"] if estimate["status"] == "ok"]
    assert scored["name"] == "sequence 0"
    assert scored["estimates"] is None
    assert scored["intensity"] == {
        "mean": pytest.approx(sum(settled) / len(settled)),
        "peak": max(settled),
        "last": settled[-1],
    }
    assert scored["duration_s"] == pytest.approx(149 / 60)
    assert scored["level"] == detailed["estimates"][-1]["level"]
    assert 0 <= scored["strong"] <= 1
    assert answer["model"]["purpose"] in ("demo", "research")


def test_probabilities_hold_for_the_whole_sequence(http: httpx.Client) -> None:
    slow = frames_of(motion(150), rate_hz=30)
    answer = http.post("/v1/score", json=score_request(slow, emotion={"joy": 0.7, "fear": 0.1}))
    assert {estimate["emotion"] for estimate in answer.json()["sequences"][0]["estimates"]} == {"joy"}


def test_an_unseen_body_has_no_intensity(http: httpx.Client) -> None:
    nothing = [{"seq": 0, "t": 0.0, "q": [None] * 13}]
    (scored,) = http.post("/v1/score", json=score_request(nothing)).json()["sequences"]
    assert scored["intensity"] == {"mean": None, "peak": None, "last": None}
    assert scored["level"] is None


# --- files ------------------------------------------------------------------------------------------------------------


def test_a_file_is_scored_as_body_and_as_form(http: httpx.Client) -> None:
    content = bvh(90).encode()
    raw = http.post("/v1/score/file", params={"filename": "wave.bvh", "emotion": "joy"}, content=content)
    form = http.post("/v1/score/file", files={"file": ("wave.bvh", content)}, data={"emotion": "joy"})
    assert raw.status_code == 200
    assert raw.json() == form.json()
    assert raw.json()["sequences"][0]["name"] == "wave"
    assert raw.json()["sequences"][0]["emotion"] == "joy"
    assert raw.json()["sequences"][0]["frames"] == 90


def test_several_files_are_scored_in_their_order(http: httpx.Client) -> None:
    files = [("file", (f"take{n}.bvh", bvh(30 + n).encode())) for n in range(3)]
    sequences = http.post("/v1/score/file", files=files, params={"detail": "frames"}).json()["sequences"]
    assert [scored["name"] for scored in sequences] == ["take0", "take1", "take2"]
    assert [len(scored["estimates"]) for scored in sequences] == [30, 31, 32]


@pytest.mark.parametrize("suffix", ["csv", "jsonl", "npz"])
def test_every_kind_of_recording_is_scored_the_same(suffix: str, http: httpx.Client, tmp_path: Path) -> None:
    poses = motion(60)
    recording = Recording("walk", C13, np.arange(60) / 60, poses, np.ones((60, 13), np.bool_), "local")
    path = tmp_path / f"walk.{suffix}"
    write_recording(recording, path)
    answer = http.post("/v1/score/file", params={"filename": path.name, "skeleton": "c13"}, content=path.read_bytes())
    assert answer.status_code == 200, answer.text
    (scored,) = answer.json()["sequences"]
    (expected,) = http.post("/v1/score", json=score_request(frames_of(poses))).json()["sequences"]
    assert scored["intensity"] == pytest.approx(expected["intensity"], abs=1e-5)


def test_real_files_are_scored(http: httpx.Client, shared_data: Path) -> None:
    for path in (shared_data / "cmu" / "79_69.bvh", shared_data / "100style" / "angry_reference.bvh"):
        answer = http.post("/v1/score/file", params={"filename": path.name}, content=path.read_bytes())
        assert answer.status_code == 200
        assert 0 < answer.json()["sequences"][0]["intensity"]["mean"] < 1


# --- wrong in every way -----------------------------------------------------------------------------------------------


def told(answer: httpx.Response) -> tuple[int, str]:
    """Status and sentence of a problem."""
    assert answer.headers["content-type"] == "application/problem+json"
    body = answer.json()
    assert body["status"] == answer.status_code
    assert "\n" not in body["detail"]
    assert "Traceback" not in answer.text
    return answer.status_code, body["detail"]


WRONG = {
    "not JSON": (b"{", 422, "not JSON"),
    "nothing": (b"", 422, "not JSON"),
    "a list": (b"[]", 422, "input should be an object"),
    "no sequences": (b"{}", 422, "sequences is missing"),
    "none at all": (b'{"sequences": []}', 422, "sequences: "),
    "no frames": (b'{"sequences": [{"frames": []}]}', 422, "sequences.0.frames: "),
    "unknown field": (json.dumps({**SHORT, "speed": 2}).encode(), 422, "speed is not a field"),
    "unknown skeleton": (json.dumps({**SHORT, "skeleton": "octopus"}).encode(), 422, "skeleton 'octopus' is not known"),
    "unknown emotion": (json.dumps(score_request(FRAMES[:3], emotion="jooy")).encode(), 422, "emotion 'jooy'"),
    "unknown clock": (json.dumps({**SHORT, "clock": "sundial"}).encode(), 422, "clock: "),
    "wrong joints": (
        json.dumps(score_request([{"t": 0, "q": [[0, 0, 0, 1]] * 12}], name="walk")).encode(),
        422,
        "frame 0 of body 'walk' has 12 joints in q; expected 13",
    ),
    "not a number": (
        json.dumps(score_request([{"t": 0, "q": [[float("nan"), 0, 0, 1]] * 13}])).encode(),
        422,
        "expected four finite numbers",
    ),
    "no time": (json.dumps(score_request([{"q": [None] * 13}])).encode(), 422, "has no t; clock 'time' needs seconds"),
    "bad UTF-8": (b'{"sequences": "\xff\xfe"}', 422, "not JSON"),
    "deep": (b"[" * 100_000, 422, "not JSON"),
}


@pytest.mark.parametrize(("body", "status", "sentence"), WRONG.values(), ids=WRONG)
def test_a_wrong_request_is_told_in_a_sentence(body: bytes, status: int, sentence: str, http: httpx.Client) -> None:
    answer = told(http.post("/v1/score", content=body))
    assert answer[0] == status
    assert sentence in answer[1]


WRONG_FILES = {
    "truncated": ({"content": bvh(90).encode()[:1500]}, "wave.bvh, line "),
    "empty": ({"content": b""}, "the file is empty"),
    "binary": ({"content": b"\x00\x01" * 1000}, "the file is binary"),
    "another kind": ({"content": b"<html></html>"}, "not a BVH file"),
    "no kind at all": ({"content": b"<svg/>", "params": {"filename": ""}}, "mvnx"),
    "an unknown skeleton": (
        {
            "content": b"#rate_hz: 30\na.x,a.y,a.z,a.w\n0,0,0,1\n",
            "params": {"filename": "a.csv", "skeleton": "octopus"},
        },
        "octopus",
    ),
    "not a number": ({"content": bvh(3).replace("40 10", "nan 10").encode()}, "expected a finite number, found 'nan'"),
    "unknown emotion": ({"content": bvh(3).encode(), "params": {"emotion": "jooy"}}, "emotion 'jooy' is not known"),
    "unknown option": ({"content": bvh(3).encode(), "params": {"colour": "red"}}, "query colour"),
    "unknown field": ({"files": {"file": ("a.bvh", bvh(3))}, "data": {"colour": "red"}}, "colour is not a field"),
    "no file": ({"files": {}, "data": {}, "headers": {"content-type": "multipart/form-data; boundary=x"}}, "no file"),
    "no boundary": ({"content": b"x", "headers": {"content-type": "multipart/form-data"}}, "the form can't be read"),
}


@pytest.mark.parametrize(("request_", "sentence"), WRONG_FILES.values(), ids=WRONG_FILES)
def test_a_wrong_file_is_told_in_a_sentence(request_: dict, sentence: str, http: httpx.Client) -> None:
    params = {"filename": "wave.bvh", **request_.get("params", {})}
    status, detail = told(http.post("/v1/score/file", **{**request_, "params": params}))
    assert status == 422
    assert sentence in detail


def test_limits_are_told(strict: httpx.Client) -> None:
    assert told(strict.post("/v1/score", content=b"x" * 30_000)) == (
        413,
        "the request is larger than 20000 bytes, the most that this service takes",
    )
    assert told(strict.post("/v1/score", content=(b"x" * 1000 for _ in range(30))))[0] == 413
    many = score_request([{"t": n, "q": [None] * 13} for n in range(11)])
    assert told(strict.post("/v1/score", json=many)) == (
        413,
        "the request has 11 frames; this service takes at most 10 in one request",
    )
    assert "3 sequences" in told(strict.post("/v1/score", json={"sequences": SHORT["sequences"] * 3}))[1]
    assert "11 frames" in told(strict.post("/v1/score/file", params={"filename": "a.bvh"}, content=bvh(11).encode()))[1]
    assert strict.post("/v1/score/file", params={"filename": "a.bvh"}, content=bvh(10).encode()).status_code == 200


# --- the process ------------------------------------------------------------------------------------------------------


async def test_scoring_hurts_no_live_session(live: Live) -> None:
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        undisturbed = await stream.follow(FRAMES)
    async with httpx.AsyncClient(base_url=live.url, timeout=60) as client, talk(live) as stream:
        await stream.start(emotion="joy")
        scoring = asyncio.create_task(client.post("/v1/score", json=score_request(frames_of(motion(3000)))))
        assert await stream.follow(FRAMES) == undisturbed
        assert (await scoring).status_code == 200


@pytest.mark.parametrize("field", ["file", "option"])
def test_a_form_of_countless_parts_is_told_413(field: str, http: httpx.Client) -> None:
    part = 'Content-Disposition: form-data; name="{}{}"{}\r\n\r\n'
    parts = "".join(
        f"--b\r\n{part.format(field, number, '; filename=a.bvh' if field == 'file' else '')}x\r\n"
        for number in range(50_000)
    )
    content_type = {"Content-Type": "multipart/form-data; boundary=b"}
    answer = http.post("/v1/score/file", content=f"{parts}--b--\r\n", headers=content_type)
    assert answer.status_code == 413
    assert answer.json()["code"] == "too_large"


def test_a_request_that_takes_too_long_is_given_up_and_the_next_is_answered(start_service) -> None:
    service = start_service(score_timeout_s=0.01)
    request = score_request(frames_of(motion(300)))
    answer = httpx.post(f"{service.url}/v1/score", json=request, timeout=60)
    assert (answer.status_code, answer.json()["detail"]) == (
        503,
        "the request took longer than 0.01 s, and was given up",
    )
    service.service.scoring._timeout_s = 60.0
    assert httpx.post(f"{service.url}/v1/score", json=request, timeout=60).status_code == 200


async def test_a_request_too_many_is_told_to_come_later(start_service) -> None:
    service = start_service(score_queue=1)
    async with httpx.AsyncClient(base_url=service.url, timeout=60) as client:
        request = score_request(frames_of(motion(1500)))
        answers = await asyncio.gather(*(client.post("/v1/score", json=request) for _ in range(4)))
    refused = [answer for answer in answers if answer.status_code != 200]
    assert refused
    assert {told(answer)[0] for answer in refused} == {503}
    assert refused[0].headers["retry-after"] == "5"


def test_a_scoring_process_that_dies_costs_one_request_at_most(start_service) -> None:
    service = start_service()
    with httpx.Client(base_url=service.url, timeout=60) as client:
        assert client.post("/v1/score", json=SHORT).status_code == 200
        os.kill(service.service.scoring._process.pid, signal.SIGKILL)
        assert client.post("/v1/score", json=SHORT).status_code in (200, 500)  # whether its end was seen before
        assert client.post("/v1/score", json=SHORT).status_code == 200
        assert client.get("/readyz").status_code == 200


def test_a_scoring_process_that_was_seen_to_die_costs_none(start_service) -> None:
    service = start_service()
    with httpx.Client(base_url=service.url, timeout=60) as client:
        assert client.post("/v1/score", json=SHORT).status_code == 200
        process = service.service.scoring._process
        os.kill(process.pid, signal.SIGKILL)
        until(lambda: process.returncode is not None)
        assert client.post("/v1/score", json=SHORT).status_code == 200


def test_a_process_that_dies_over_a_request_is_named_as_the_fault(start_service) -> None:
    service = start_service()
    with httpx.Client(base_url=service.url, timeout=60) as client, ThreadPoolExecutor(1) as beside:
        assert client.post("/v1/score", json=SHORT).status_code == 200
        process = service.service.scoring._process
        os.kill(process.pid, signal.SIGSTOP)
        answer = beside.submit(httpx.post, f"{service.url}/v1/score", json=SHORT, timeout=60)
        until(service.service.scoring._turn.locked)
        os.kill(process.pid, signal.SIGKILL)
        status, detail = told(answer.result())
        assert status == 500
        assert detail.startswith("the scoring process ended on this request")
        assert client.post("/v1/score", json=SHORT).status_code == 200


def test_a_model_file_that_changed_is_not_used(start_service, tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(default_model_path().read_bytes())
    service = start_service(model=path)
    path.write_bytes(b"something else")
    status, detail = told(httpx.post(f"{service.url}/v1/score", json=SHORT, timeout=60))
    assert status == 500
    assert detail.startswith("the model file changed since the service started")
