"""Whatever comes over HTTP, the socket or into a session: the answer is documented, and nobody else notices."""

import asyncio
import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import msgpack
import pytest
import websockets
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bodies import as_read, host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import CloseCode, FervorError
from fervor.protocol.asyncapi import FROM_WEBSOCKET
from fervor.protocol.codec import CODECS, Codec
from fervor.protocol.lean_frame import LeanFrames
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Estimates,
    Frame,
    Frames,
    Ping,
    SessionCalibrate,
    SessionEnd,
    SessionStart,
)
from fervor.session.events import Close, Event, Release, Reply, Restore, Ticket
from fervor.session.poses import read_poses
from fervor.session.session import Session
from fervor.session.state import SessionState
from live import Live, RawClient, eventually, frames_of, talk

FRAMES = frames_of(motion(30))
CLOSES = {int(code) for code in CloseCode} | set(FROM_WEBSOCKET)
fuzz = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

# --- HTTP -------------------------------------------------------------------------------------------------------------


NEVER_TAKEN = {"GET /v1/stream", "GET /v1/watch", "POST /v1/score/file", "POST /v1/convert"}
"""A plain GET is no WebSocket, and bytes drawn at random are no recording: here only refusals are tried."""


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_every_http_answer_is_one_that_the_openapi_document_has(live: Live, tmp_path: Path) -> None:
    """schemathesis sends what the document allows and what it forbids.

    Left out is the check that whatever fits the schema is taken: a frame that has no time fits it.
    """
    program = Path(sys.executable).with_name("schemathesis")
    options = (
        "--checks all --exclude-checks positive_data_acceptance --phases examples,coverage,fuzzing --max-examples 25 "
        "--seed 1 --no-color --report-json-path report.json"
    )
    result = subprocess.run(
        [program, "run", f"{live.url}/openapi.json", *options.split()],
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stdout
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["complete"]
    assert (report["failures"], report["errors"]) == ([], [])
    operations = report["operations"]
    assert operations["tested"] == operations["selected"] == operations["total"] > 0
    taken = {name for name, phases in report["valid_rates"].items() if any(p["accepted"] for p in phases.values())}
    assert len(taken) == operations["total"] - len(NEVER_TAKEN)
    assert not taken & NEVER_TAKEN


# --- the socket -------------------------------------------------------------------------------------------------------

numbers = st.integers(-3, 2**64 - 1) | st.floats(width=32)
anything = st.recursive(
    st.none() | st.booleans() | numbers | st.text(max_size=8) | st.binary(max_size=16),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=8), inner, max_size=5),
    max_leaves=20,
)
TYPES = ("session.start", "frame", "frames", "body.reset", "body.end", "session.calibrate", "ping", "session.end")
NAMES = sorted({name for kind in (SessionStart, Frame, Frames, SessionCalibrate, Ping) for name in kind.model_fields})
near = st.builds(
    lambda kind, fields: {**fields, "type": kind},
    st.sampled_from(TYPES),
    st.dictionaries(st.sampled_from(NAMES), anything),
)


def as_json(value: object) -> str:
    return json.dumps(value, default=lambda raw: raw.hex())


async def answered(live: Live, subprotocol: str, messages: list[str | bytes], *, start: bool) -> None:
    """Send it all: what comes back can be read, and if the service closes, with a code that the documents have."""
    codec = CODECS[subprotocol]
    uri = live.stream
    async with websockets.connect(uri, subprotocols=[subprotocol], compression=None) as socket:
        with suppress(websockets.ConnectionClosed):
            if start:
                await socket.send(codec.encode(SessionStart()))
            for message in messages:
                await socket.send(message)
            await socket.send(codec.encode(Ping(id="the last")))
            while (heard := codec.decode_server(await socket.recv())).type != "pong" or heard.id != "the last":
                assert heard.type != "error" or heard.message
            return
    assert socket.close_code in CLOSES


async def neighbour(live: Live) -> list[dict]:
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        return await stream.follow(FRAMES)


@pytest.fixture(scope="module")
def expected(live: Live) -> list[dict]:
    return asyncio.run(neighbour(live))


@fuzz
@given(
    messages=st.lists(st.text(max_size=40) | st.binary(max_size=40) | near.map(as_json), max_size=12),
    start=st.booleans(),
)
def test_anything_in_json(live: Live, messages, start) -> None:
    asyncio.run(answered(live, "fervor.v1.json", messages, start=start))


@fuzz
@given(
    messages=st.lists(
        st.text(max_size=40) | st.binary(max_size=40) | near.map(msgpack.packb) | anything.map(msgpack.packb),
        max_size=12,
    ),
    start=st.booleans(),
)
def test_anything_in_messagepack(live: Live, messages, start) -> None:
    asyncio.run(answered(live, "fervor.v1.msgpack", messages, start=start))


@settings(fuzz, max_examples=20)
@given(data=st.binary(min_size=1, max_size=300))
def test_bytes_that_are_no_websocket_end_one_connection(live: Live, data: bytes) -> None:
    client = RawClient(live)
    client.socket.settimeout(20)
    with suppress(ConnectionError):
        client.socket.sendall(data)
        client.socket.shutdown(1)
        while client.socket.recv(65_536):
            pass
    client.socket.close()


async def test_nobody_else_has_noticed(live: Live, expected: list[dict]) -> None:
    """After all of the above."""
    assert await neighbour(live) == expected
    await eventually(lambda: live.service.sessions.open == 0)
    assert live.service.batcher.engine.slots.taken <= 1  # the probe's


# --- a session --------------------------------------------------------------------------------------------------------

POSES = [tuple(map(tuple, pose.tolist())) for pose in motion(40)]
BODIES = st.sampled_from(["a", "b", "c"])
frames = st.builds(
    Frame,
    body=BODIES,
    seq=st.integers(0, 40),
    t=st.none() | st.floats(-1e6, 1e6) | st.integers(0, 40).map(lambda k: k / 10),
    q=st.sampled_from([*POSES[:10], POSES[0][:5], None, (None,) * 13, ((9.0, 0.0, 0.0, 0.0),) * 13]),
    mask=st.sampled_from([None, (True,) * 13, (False,) * 13, (True,)]),
    emotion=st.sampled_from([None, "joy", "ennui", {"fear": 0.5}, {"fear": -1.0}]),
)
said = st.one_of(
    frames,
    frames,
    st.builds(Frames, frames=st.lists(frames, min_size=1, max_size=8).map(tuple)),
    st.builds(BodyReset, body=BODIES),
    st.builds(BodyEnd, body=BODIES),
    st.builds(SessionCalibrate, body=BODIES, seconds=st.just(0.2)),
    st.builds(Ping),
    st.builds(SessionEnd),
    st.builds(
        SessionStart,
        skeleton=st.sampled_from(["c13", "c13", "octopus"]),
        clock=st.sampled_from(["time", "frames"]),
        memory=st.sampled_from(["staggered", "stateful"]),
        delivery=st.sampled_from(["every", "latest"]),
        checkpoint_s=st.none() | st.just(0.5),
        resume=st.sampled_from([(), ("garbage",)]),
    ),
)


class Edge:
    """Carries out what a session asks, and counts what it answers."""

    def __init__(self) -> None:
        self.engine = Engine(model(), capacity=2)
        self.session = Session("s", host(self.engine.claim, max_bodies=2, max_frames_per_message=6))
        self.work: list[Ticket] = []
        self.answers = 0
        self.closed: list[Close] = []
        self.said: list[object] = []

    def carry(self, events) -> None:
        for event in events:
            match event:
                case Reply(message):
                    self._heard(message)
                case Ticket():
                    self.work.append(event)
                case Release(slot):
                    self.toil()
                    self.engine.release(slot)
                case Restore():
                    raise AssertionError("nothing is to be restored")
                case Close():
                    self.closed.append(event)

    def toil(self, most: int = 1000) -> None:
        while self.work and most:
            ticket = self.work.pop(0)
            self.carry(self.session.conclude(ticket, self.engine.run([ticket])[0]))
            most -= 1

    def _heard(self, message) -> None:
        assert not self.closed, "nothing is said after the close"
        read = as_read(message)
        self.said.append(read)
        assert all(codec.decode_server(codec.encode(message)) == read for codec in CODECS.values())
        self.answers += len(read.estimates) if isinstance(read, Estimates) else read.type == "estimate"
        self.answers += message.type == "error" and message.seq is not None


def frames_in(message) -> int:
    if isinstance(message, Frames):
        return len(message.frames) if len(message.frames) <= 6 else 0
    return isinstance(message, Frame)


@settings(max_examples=150, deadline=None)
@given(opened=st.booleans(), messages=st.lists(said, max_size=25), dice=st.randoms())
def test_any_messages_in_any_order(opened, messages, dice) -> None:
    """No message raises; every frame has one answer; what is said can be encoded; nothing is left behind."""
    edge, asked = Edge(), 0
    for message in [SessionStart(checkpoint_s=0.5)] * opened + messages:
        asked += frames_in(message) if edge.session.state is SessionState.OPEN else 0
        edge.carry(edge.session.receive(message))
        edge.toil(dice.randint(0, 3))
    edge.toil()
    if opened and all(close.code is CloseCode.NORMAL for close in edge.closed):
        assert edge.answers == asked
    edge.carry(edge.session.lost())
    assert edge.engine.slots.taken == 0
    assert len(edge.closed) <= 1
    assert edge.session.refuse(FervorError("x")) == []


@settings(max_examples=100, deadline=None)
@given(messages=st.lists(said, max_size=15), encoding=st.sampled_from(sorted(CODECS)))
def test_frames_off_the_wire_are_answered_as_those_that_pydantic_made(messages, encoding) -> None:
    """To the bit: lean frames whose poses were read in blocks, beside the same messages one by one."""
    codec, plain, lean = CODECS[encoding], Edge(), Edge()
    for message in [SessionStart(), *messages]:
        plain.carry(plain.session.receive(message))
        lean.carry(taken(lean.session, codec, codec.encode(message)))
        for edge in (plain, lean):
            edge.toil()
    assert lean.said == plain.said
    assert lean.closed == plain.closed
    assert lean.session.totals == plain.session.totals


def taken(session: Session, codec: Codec, data: str | bytes) -> list[Event]:
    """What a message brings that is taken as a turn takes it."""
    frames, agreement = codec.decode_frames(data), session.agreement
    if frames is None or agreement is None:
        return session.receive(codec.decode_client(data))
    each = frames.frames if isinstance(frames, LeanFrames) else (frames,)
    return session.receive(frames, read_poses([(agreement, frame) for frame in each]))
