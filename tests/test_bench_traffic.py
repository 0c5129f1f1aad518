"""What the load generator sends is what the protocol says."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.protocol.codec import CODECS
from fervor.protocol.messages import Frame, Frames, SessionStart
from fervor_bench.errors import BenchError
from fervor_bench.traffic import CYCLE, HEAD, MASK_KEY, Traffic, framed


def decode(traffic: Traffic, payload: bytes):
    codec = CODECS[traffic.subprotocol]
    return codec.decode_client(payload.decode() if traffic.encoding == "json" else payload)


def unframed(data: bytes) -> tuple[int, bytes]:
    """Opcode and payload of a masked frame, by RFC 6455 5.2."""
    size, at = data[1] & 127, 2
    if size == 126:
        (size,), at = struct.unpack_from(">H", data, 2), 4
    elif size == 127:
        (size,), at = struct.unpack_from(">Q", data, 2), 10
    assert data[0] & 0x80
    assert data[1] & 0x80
    mask, masked = data[at : at + 4], data[at + 4 :]
    assert len(masked) == size
    return data[0] & 15, bytes(byte ^ mask[place % 4] for place, byte in enumerate(masked))


@given(st.binary(max_size=300), st.booleans())
def test_frames_are_masked_as_the_rfc_says(payload: bytes, text: bool) -> None:
    assert unframed(framed(payload, text=text)) == (1 if text else 2, payload)


@pytest.mark.parametrize("size", [125, 126, 65535, 65536])
def test_lengths_are_written_in_their_three_ways(size: int) -> None:
    assert unframed(framed(bytes(size), text=False)) == (2, bytes(size))


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
@pytest.mark.parametrize("joints", [13, 25])
def test_messages_are_frames_of_the_protocol(encoding, joints: int) -> None:
    traffic = Traffic(encoding=encoding, joints=joints, bodies=2, jitter_s=0)
    start = decode(traffic, traffic.encode(traffic.start()))
    assert isinstance(start, SessionStart)
    assert start.checkpoint_s == 1.0
    frames = [decode(traffic, payload) for payload in traffic.payloads(0, 2 * CYCLE + 4)]
    assert all(isinstance(frame, Frame) for frame in frames)
    assert [frame.seq for frame in frames] == list(range(len(frames)))
    assert [frame.body for frame in frames[:4]] == ["0", "1", "0", "1"]
    assert [frame.t for frame in frames[::2]] == pytest.approx([step / 30 for step in range(CYCLE + 2)], abs=1e-6)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_times_are_a_sensors(encoding) -> None:
    traffic = Traffic(encoding=encoding, bodies=2)
    times = [decode(traffic, payload).t for payload in traffic.payloads(3, 600)]
    assert times[::2] == times[1::2] == traffic.times(3, 300).tolist()
    off = np.array(times[::2]) - np.arange(300) / 30  # from an even clock that began at any time
    assert 0.0075 < np.ptp(off) <= 0.008
    assert (np.diff(times[::2]) > 0).all()


def test_frames_off_the_grid_bring_no_step_of_it_one_or_two() -> None:
    brought: set[int] = set()
    for variant in range(8):
        times = Traffic().times(variant, 300)
        newest = np.floor((times - times[0]) * 30 + 1e-6)
        brought |= set(np.diff(newest).astype(int).tolist())
    assert brought == {0, 1, 2}


def test_sensors_begin_at_their_own_time_and_go_on_as_they_began() -> None:
    traffic = Traffic()
    assert len({float(traffic.times(variant, 1)[0]) for variant in range(32)}) == 32
    assert traffic.times(5, 10).tolist() == traffic.times(5, 200)[:10].tolist()


@pytest.mark.parametrize("jitter_s", [-0.001, 0.02, float("nan")])
def test_times_that_might_not_rise_are_refused(jitter_s: float) -> None:
    with pytest.raises(BenchError, match="expected 0 or more, and less than 16"):
        Traffic(jitter_s=jitter_s)


def test_both_encodings_carry_the_same_motion() -> None:
    text, packed = Traffic(encoding="json"), Traffic(encoding="msgpack")
    for one, other in zip(text.payloads(3, 20), packed.payloads(3, 20), strict=True):
        raw = decode(packed, other).q.root
        expected = np.array(decode(text, one).q, np.float32)
        np.testing.assert_array_equal(np.frombuffer(raw, "<f4").reshape(13, 4), expected)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
@pytest.mark.parametrize("count", [2, 20])
def test_several_frames_go_into_one_message(encoding, count: int) -> None:
    traffic = Traffic(encoding=encoding, frames_per_message=count)
    messages = [decode(traffic, payload) for payload in traffic.payloads(0, 3)]
    assert all(isinstance(message, Frames) for message in messages)
    assert [frame.seq for message in messages for frame in message.frames] == list(range(3 * count))


def test_frames_that_do_not_go_with_the_bodies_are_refused() -> None:
    with pytest.raises(BenchError, match="4 frames in a message do not go with 3 bodies"):
        Traffic(bodies=3, frames_per_message=4)


def test_joints_that_no_skeleton_has_are_refused() -> None:
    with pytest.raises(BenchError, match=r"no skeleton has 14 joints; expected one of .*13"):
        Traffic(joints=14).start()


def test_a_script_holds_request_start_and_all_messages(tmp_path) -> None:
    traffic = Traffic(encoding="json", bodies=2)
    path = tmp_path / "script"
    traffic.write(path, address="robot.local:80", target="/v1/stream", variants=3, messages=5, token="let-me-in")
    data = path.read_bytes()
    variants, messages, frames, bodies, request_size, start_size, rate_hz = HEAD.unpack_from(data)
    assert (variants, messages, frames, bodies, rate_hz) == (3, 5, 1, 2, 30.0)
    at = HEAD.size
    offsets = np.frombuffer(data, "<u8", 3 * 5 + 1, at)
    at += offsets.nbytes
    request = data[at : at + request_size].decode()
    assert request.startswith("GET /v1/stream HTTP/1.1\r\nHost: robot.local:80\r\n")
    assert "Sec-WebSocket-Protocol: fervor.v1.json\r\n" in request
    assert request.endswith("Authorization: Bearer let-me-in\r\n\r\n")
    at += request_size
    opcode, start = unframed(data[at : at + start_size])
    assert isinstance(decode(traffic, start), SessionStart)
    assert opcode == 1
    at += start_size
    sent = [
        unframed(data[at + a : at + b])[1] for a, b in zip(offsets[:-1].tolist(), offsets[1:].tolist(), strict=True)
    ]
    assert at + int(offsets[-1]) == len(data)
    assert sent == [payload for variant in range(3) for payload in traffic.payloads(variant, 5)]


def test_the_mask_is_none_of_zeros() -> None:
    assert all(MASK_KEY)
