"""The golden transcripts: the real service says what they say, and the Python client reads and sends what they hold."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest

from fervor.errors import CloseCode, MessageError, Unreachable
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import ClientMessage, Estimate, ServerMessage, SessionStart
from fervor.settings import Transport
from fervor_client.conversation import Conversation
from fervor_client.retrying import Retries
from transcripts import FOLDER, Line, Player, differs, filled, load

PATHS = sorted(FOLDER.glob("*.jsonl"))
ALL = {path.stem: load(path) for path in PATHS}
JSON, MSGPACK = CODECS["fervor.v1.json"], CODECS["fervor.v1.msgpack"]

NOT_HERE = {
    CloseCode.GOING_AWAY: "a client's, or a proxy's",
    CloseCode.INTERNAL: "a fault of the service: tests/test_server_poison.py",
    CloseCode.OVERLOADED: "a client that reads nothing: tests/test_server_stream.py",
    CloseCode.AUTH: "reserved: a wrong token is refused before the upgrade",
}


def lines_of(kind: str) -> Iterator[Line]:
    return (line for lines in ALL.values() for line in lines if kind in line)


@pytest.mark.parametrize("way", get_args(Transport))
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_the_service_says_what_the_transcript_says(path: Path, way: Transport) -> None:
    about, *lines = load(path)
    asyncio.run(Player([{**about, "settings": {**about["settings"], "transport": way}}, *lines]).play())


def test_they_cover_the_protocol() -> None:
    said = {line["client"]["type"] for line in lines_of("client")}
    heard = {line["server"]["type"] for line in lines_of("server")}
    assert {kind.model_fields["type"].default for kind in get_args(get_args(ClientMessage)[0])} <= said
    assert {kind.model_fields["type"].default for kind in get_args(get_args(ServerMessage)[0])} == heard
    assert {line["accepted"] for line in lines_of("accepted")} == set(CODECS)
    assert {line["refused"]["status"] for line in lines_of("refused")} == {400, 401, 503}
    assert {line["closed"] for line in lines_of("closed")} - {1007} == set(CloseCode) - set(NOT_HERE)
    flags = {flag for line in lines_of("server") for flag in line["server"].get("flags", ())}
    kinds = get_args(get_args(get_args(Estimate.model_fields["flags"].annotation)[0])[0])
    assert flags >= set(kinds)
    codes = {line["server"]["code"] for line in lines_of("server") if line["server"]["type"] == "error"}
    assert codes == {
        "bad_frame", "bad_input", "bad_message", "checkpoint_mismatch", "checkpoint_unknown", "idle_timeout",
        "overloaded", "rate_exceeded", "start_timeout",
    }  # fmt: skip  # engine_failed and internal are faults of ours; too_large comes without a word


def test_the_client_reads_every_message_of_the_service() -> None:
    for line in lines_of("server"):
        message = JSON.decode_server(json.dumps(_shown(line["server"])))
        again = json.loads(JSON.encode(message))
        if line["server"]["type"] != "session.started":  # the stand-ins for model and limits say less
            assert {key: again.get(key) for key in line["server"]} == _shown(line["server"])
        if "hex" in line:
            packed = MSGPACK.decode_server(bytes.fromhex(line["hex"]))
            assert packed == message


def test_both_encodings_of_a_client_s_message_are_one() -> None:
    for line in lines_of("hex"):
        if "client" in line and "float32" not in json.dumps(line):
            assert MSGPACK.decode_client(bytes.fromhex(line["hex"])) == JSON.decode_client(json.dumps(line["client"]))


@pytest.mark.parametrize("name", ["hello", "resume", "drain", "calibrate"])
def test_the_client_s_conversation_sends_what_the_transcript_holds(name: str) -> None:
    """Its half: told what the service says, it says what the client says there, and hands out every estimate once."""
    lines = ALL[name]
    start = next(line["client"] for line in lines if line.get("client", {}).get("type") == "session.start")
    client = _Half(start)
    for line in lines:
        if "connect" in line:
            client.connects()
        elif "client" in line:
            client.says(line["client"])
        elif "server" in line:
            client.hears(line["server"])
        elif "cut" in line or line.get("closed") == 1012:
            client.is_cut()
    assert client.conversation.over
    told = list(iter(client.conversation.next_estimate, None))
    expected = [line["server"] for line in lines if line.get("server", {}).get("type") == "estimate"]
    once = {json.dumps(estimate): estimate for estimate in expected}  # one that was sent again comes again, unchanged
    assert [json.loads(estimate.model_dump_json()) for estimate in told] == list(once.values())


class _Half:
    """The client's core, driven by a transcript."""

    def __init__(self, start: dict[str, Any]) -> None:
        self.names: dict[str, Any] = {}
        retries = Retries(None, now=lambda: 0.0, dice=lambda: 0.0)
        opening = SessionStart.model_validate_json(json.dumps(start))
        self.conversation = Conversation(opening, url="ws://x", retries=retries, now=lambda: 0.0)
        self.pending: list[str | bytes] = []

    def connects(self) -> None:
        self.pending = [self.conversation.start()]

    def is_cut(self) -> None:
        self.conversation.interrupted(Unreachable("cut"))

    def hears(self, message: dict[str, Any]) -> None:
        self.conversation.receive(json.dumps(_shown(message)))
        differs(message, _shown(message), self.names)
        self._take()

    def says(self, message: dict[str, Any]) -> None:
        if not self.pending:
            self._act(message)
            self._take()
        expected = JSON.decode_client(json.dumps(filled(message, self.names)))
        assert JSON.decode_client(self.pending.pop(0)) == expected

    def _take(self) -> None:
        while (payload := self.conversation.next_payload()) is not None:
            self.pending.append(payload)

    def _act(self, message: dict[str, Any]) -> None:
        match JSON.decode_client(json.dumps(message)):
            case SessionStart():
                raise AssertionError("a session starts on a new connection")
            case frame if frame.type == "frame":
                self.conversation.frame(frame.q, seq=frame.seq, t=frame.t, emotion=frame.emotion)
            case calibrate if calibrate.type == "session.calibrate":
                self.conversation.calibrate(calibrate)
            case ping if ping.type == "ping":
                self.pending.append(JSON.encode(ping))
            case end:
                assert end.type == "session.end"
                self.conversation.end()


def _shown(message: dict[str, Any]) -> dict[str, Any]:
    """A message of the service with something that can be read under each of its names."""
    model = {
        "name": "m", "version": "1", "purpose": "demo", "sha256": "0", "rate_hz": 30.0, "emotions": [], "thresholds": {}
    }  # fmt: skip
    stand_ins: dict[str, Any] = {"model": model, "limits": {}}
    return {
        key: stand_ins.get(key, value[2:-1]) if isinstance(value, str) and value.startswith("${") else value
        for key, value in message.items()
    }


def test_a_transcript_that_says_something_else_fails() -> None:
    lines = json.loads(json.dumps(ALL["hello"]))
    next(line for line in lines if line.get("server", {}).get("type") == "estimate")["server"]["intensity"] += 1e-3
    with pytest.raises(AssertionError, match="intensity"):
        asyncio.run(Player(lines).play())


def test_text_that_is_no_message_is_refused() -> None:
    for line in lines_of("client_text"):
        with pytest.raises(MessageError):
            JSON.decode_client(line["client_text"])
