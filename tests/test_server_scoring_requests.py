"""Requests to `/v1/score` in both encodings: read quickly or plainly, they ask for the same."""

import json

import msgpack
import numpy as np
import pytest

from bodies import model, motion
from fervor.errors import RequestError
from fervor.protocol.messages import SessionStart
from fervor.server import scoring_requests
from fervor.server.scoring_requests import MSGPACK, Asked, read_request, take_of
from fervor.session.start import agree
from fervor.skeletons.landmarks import LANDMARKS
from fervor.skeletons.rig import JOINTS

POSES = motion(5)
JSON = "application/json"


def frames(**more) -> list[dict]:
    return [{"t": n / 30, "q": pose.tolist(), **more} for n, pose in enumerate(POSES)]


def raw(**more) -> list[dict]:
    return [{"t": n / 30, "q": pose.astype("<f4").tobytes(), **more} for n, pose in enumerate(POSES)]


def request(taken: list[dict], **terms) -> dict:
    return {"sequences": [{"name": "walk", "emotion": "joy", "frames": taken}], **terms}


def takes(asked: Asked) -> list:
    start = SessionStart(**asked.terms.model_dump(exclude={"sequences", "detail"}))
    agreement = agree(start, model().metadata)
    return [take_of(number, sequence, agreement) for number, sequence in enumerate(asked.sequences)]


def same(one: Asked, other: Asked) -> None:
    terms = {"exclude": {"sequences"}}
    assert one.terms.model_dump(**terms) == other.terms.model_dump(**terms)
    for a, b in zip(takes(one), takes(other), strict=True):
        assert (a.name, a.emotion) == (b.name, b.emotion)
        for column in ("times", "rotations", "observed"):
            assert getattr(a, column).tobytes() == getattr(b, column).tobytes()


PERSON = np.random.default_rng(0).standard_normal((3, len(LANDMARKS["mediapipe"].joints), 3))
RIGHT = {
    "plain": request(frames()),
    "terms": request(frames(), clock="frames", memory="stateful", by_emotion=True, detail="frames", nominal_hz=50),
    "joints": request(frames(), joints=list(JOINTS[::-1]), quaternion="wxyz"),
    "masks": request(frames(mask=[True] * 12 + [False])),
    "nulls": request([{"t": 0, "q": [None, *POSES[0].tolist()[1:]]}]),
    "probabilities": {"sequences": [{"emotion": {"joy": 0.5}, "frames": frames()}]},
    "several": {"sequences": [{"frames": frames()[:n]} for n in (1, 3)]},
    "points": request([{"t": n / 30, "p": p.tolist()} for n, p in enumerate(PERSON)], skeleton="mediapipe"),
    "no time": request([{"q": POSES[0].tolist()}], clock="frames"),
    "an int": request([{"t": 0, "q": [[0, 0, 0, 1]] * 13}]),
}


@pytest.mark.parametrize("asked", RIGHT.values(), ids=RIGHT)
def test_both_encodings_and_both_readers_agree(asked: dict) -> None:
    text, packed = json.dumps(asked).encode(), msgpack.packb(asked)
    plain = scoring_requests._json(text)
    same(read_request(text, JSON), plain)
    same(read_request(packed, MSGPACK[0]), plain)
    same(scoring_requests._packed(packed), plain)
    assert scoring_requests._json_quickly(text)
    assert scoring_requests._packed_quickly(packed)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("asked", RIGHT.values(), ids=RIGHT)
def test_frames_at_once_are_those_one_by_one(asked: dict, packed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    read = read_request(*((msgpack.packb(asked), MSGPACK[0]) if packed else (json.dumps(asked).encode(), JSON)))
    quick = takes(read)
    monkeypatch.setattr(scoring_requests, "_take_quickly", lambda *_: None)
    for a, b in zip(quick, takes(read), strict=True):
        for column in ("times", "rotations", "observed"):
            assert getattr(a, column).tobytes() == getattr(b, column).tobytes()


def test_raw_joints_are_those_of_numbers_of_single_precision() -> None:
    single = request([{"t": n / 30, "q": np.float64(np.float32(pose)).tolist()} for n, pose in enumerate(POSES)])
    packed = msgpack.packb(request(raw()))
    same(read_request(packed, "application/x-msgpack; v=1"), scoring_requests._json(json.dumps(single).encode()))
    same(scoring_requests._packed(packed), read_request(packed, MSGPACK[1]))
    points = [{"t": n / 30, "p": p.astype("<f4").tobytes()} for n, p in enumerate(PERSON)]
    packed = msgpack.packb(request(points, skeleton="mediapipe"))
    same(scoring_requests._packed(packed), read_request(packed, MSGPACK[0]))


WRONG = {
    "nothing": (b"", "not MessagePack"),
    "cut short": (msgpack.packb(request(raw()))[:-3], "not MessagePack"),
    "a list": (msgpack.packb([]), "the message: input should be"),
    "no sequences": (msgpack.packb({}), "sequences is missing"),
    "none at all": (msgpack.packb({"sequences": []}), "sequences: "),
    "an unknown field": (msgpack.packb(request(raw(), speed=2)), "speed is not a field"),
    "an unknown field of a frame": (msgpack.packb(request(raw(seq=2))), "sequences.0.frames.0.seq is not a field"),
    "an endless time": (msgpack.packb(request([{"t": float("inf"), "q": raw()[0]["q"]}])), "sequences.0.frames.0.t: "),
    "a text for joints": (msgpack.packb(request([{"t": 0, "q": "abc"}])), "sequences.0.frames.0.q"),
    "bad UTF-8": (b"\x81\xa1\xff\x01", "not MessagePack"),
    "deep": (b"\x91" * 100_000, "not MessagePack"),
}


@pytest.mark.parametrize(("body", "sentence"), WRONG.values(), ids=WRONG)
def test_wrong_messagepack_is_told_in_a_sentence(body: bytes, sentence: str) -> None:
    with pytest.raises(RequestError) as told:
        read_request(body, MSGPACK[0])
    assert sentence in told.value.message


def test_json_takes_no_bytes() -> None:
    with pytest.raises(RequestError, match=r"sequences\.0\.frames\.0\.q"):
        read_request(json.dumps(request([{"t": 0, "q": "AAAA"}])).encode(), JSON)


def test_a_poisoned_frame_is_told_of() -> None:
    poisoned = raw()
    poisoned[3]["q"] = np.full((13, 4), np.nan, "<f4").tobytes()
    with pytest.raises(RequestError, match=r"frame 3 of body 'walk' .* expected four finite numbers"):
        takes(read_request(msgpack.packb(request(poisoned)), MSGPACK[0]))
    short = [*raw(), {"t": 1.0, "q": b"1234"}]
    with pytest.raises(RequestError, match="frame 5 of body 'walk' has 4 bytes in q; expected 208"):
        takes(read_request(msgpack.packb(request(short)), MSGPACK[0]))
