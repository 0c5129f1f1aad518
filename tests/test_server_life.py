"""The life of a conversation on a wire that does as it is told: held back, timed out, left behind, signed off once."""

import asyncio
import json

import pytest

from bodies import motion
from fervor.errors import CloseCode
from fervor.protocol.codec import CODECS
from fervor.server.conversation import Conversation
from fervor.server.service import Service
from fervor.settings import Settings
from live import PROTOCOL, frames_of

FRAMES = frames_of(motion(12))
LIMITS = {"max_unanswered_frames": 3, "start_timeout_s": 10.0, "idle_timeout_s": 60.0}


@pytest.fixture(scope="module")
def service() -> Service:
    return Service.open(Settings.load(**LIMITS))


class Recorder:
    """A wire that remembers what was asked of it."""

    def __init__(self) -> None:
        self.said: list[dict] = []
        self.closed: tuple[CloseCode, str] | None = None
        self.stuck = False
        self.reads = True
        self.pauses = self.looks = 0
        self.left = False

    async def carry(self, listener) -> None:
        pass

    def write(self, message: str | bytes) -> bool:
        if not self.stuck:
            self.said.append(json.loads(message))
        return not self.stuck

    def close(self, code: CloseCode, reason: str) -> bool:
        if not self.stuck:
            self.closed = (code, reason)
        return not self.stuck

    def pause(self) -> None:
        self.reads = False
        self.pauses += 1

    def resume(self) -> None:
        self.reads = True

    def leave(self) -> None:
        self.left = True

    def look(self, now: float) -> None:
        self.looks += 1


async def begin(service: Service, wire: Recorder) -> Conversation:
    service.sessions.admit()
    conversation = Conversation(wire, service, CODECS[PROTOCOL], client="pepper")
    await conversation.run()
    return conversation


def say(conversation: Conversation, type_: str, **fields) -> None:
    conversation.came(json.dumps({"type": type_, **fields}))


async def until(condition) -> None:
    """Let the event loop turn until something is so."""
    async with asyncio.timeout(10):
        while not condition():
            await asyncio.sleep(0)


async def test_a_client_far_ahead_is_held_back_and_answered_in_order(service: Service) -> None:
    wire = Recorder()
    conversation = await begin(service, wire)
    say(conversation, "session.start")
    await until(lambda: wire.said)
    for frame in FRAMES:  # as many as were read before the pause had its effect
        say(conversation, "frame", **frame)
    assert not wire.reads
    await until(lambda: len(wire.said) == 1 + len(FRAMES))
    assert [estimate["seq"] for estimate in wire.said[1:]] == list(range(len(FRAMES)))
    await until(lambda: wire.reads)
    assert wire.pauses == 1
    conversation.lost()


async def test_what_is_held_back_dies_with_its_session(service: Service) -> None:
    wire = Recorder()
    taken = service.batcher.engine.slots.taken
    conversation = await begin(service, wire)
    say(conversation, "session.start")
    await until(lambda: wire.said)
    for frame in FRAMES:
        say(conversation, "frame", **frame)
    conversation.lost()
    await until(lambda: not service.batcher.depth and not service.turn.depth)
    assert len(wire.said) == 1
    assert service.batcher.engine.slots.taken == taken


async def test_it_is_over_once_however_often_that_is_said(service: Service) -> None:
    wire, begun = Recorder(), service.sessions.open
    conversation = await begin(service, wire)
    assert service.sessions.open == begun + 1
    assert conversation in service.drain.talking
    say(conversation, "ping")
    await until(lambda: wire.said)
    conversation.lost()
    conversation.lost()
    assert service.sessions.open == begun
    assert conversation not in service.drain.talking
    assert wire.left
    assert wire.closed is None  # there is nobody to tell


async def test_after_its_close_it_leaves_when_all_else_is_done(service: Service) -> None:
    wire = Recorder()
    conversation = await begin(service, wire)
    say(conversation, "session.start")
    say(conversation, "session.end")
    await until(lambda: wire.closed)
    assert wire.closed == (CloseCode.NORMAL, "ended by the client")
    await until(lambda: wire.left)
    assert conversation not in service.drain.talking


async def test_a_close_that_waits_is_sent_when_the_client_takes_it(service: Service) -> None:
    wire = Recorder()
    conversation = await begin(service, wire)
    wire.stuck = True
    say(conversation, "session.start")
    say(conversation, "session.end")
    await until(lambda: not wire.reads)  # who may not be heard any more is not read
    assert wire.said == []
    wire.stuck = False
    conversation.writable()
    assert [message["type"] for message in wire.said] == ["session.started", "session.ended"]
    assert wire.closed == (CloseCode.NORMAL, "ended by the client")
    await until(lambda: wire.left)


async def test_who_does_not_take_his_close_is_left_behind(
    service: Service, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("fervor.server.life.CLOSE_GRACE_S", 0.0)
    caplog.set_level("INFO")
    wire = Recorder()
    conversation = await begin(service, wire)
    wire.stuck = True
    say(conversation, "frame", **FRAMES[0])  # before a start: fatal
    await until(lambda: wire.left)
    assert wire.closed is None
    assert caplog.messages[-2] == "the client did not take its close"
    assert caplog.messages[-1].startswith("session ended: bad_message, after ")


async def test_timeouts_count_from_the_start_and_from_the_newest_message(service: Service) -> None:
    wire = Recorder()
    conversation = await begin(service, wire)
    opened = conversation._opened
    say(conversation, "ping")
    await until(lambda: wire.said)
    conversation.look(opened + 9.9)
    assert wire.looks == 1
    assert wire.closed is None
    conversation.look(opened + 10.0)
    assert wire.said[-1]["code"] == "start_timeout"
    assert wire.closed is not None
    conversation.look(opened + 100.0)  # it is closed, and nothing is said twice
    assert [message.get("code") for message in wire.said].count("start_timeout") == 1

    wire = Recorder()
    conversation = await begin(service, wire)
    say(conversation, "session.start")
    await until(lambda: wire.said)
    conversation.look(conversation._heard + 59.9)
    assert wire.closed is None
    conversation.look(conversation._heard + 60.0)
    assert wire.said[-1]["message"] == "nothing came for 60 s"
    assert wire.closed == (CloseCode.TIMEOUT, "idle_timeout")
    await until(lambda: wire.left)
