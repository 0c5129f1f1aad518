"""What a client sends beside whole messages: found, judged and answered however it is cut up."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.protocol import OPEN
from websockets.uri import parse_uri

from fervor.errors import CloseCode
from fervor.server.parser import Parser

MOST = 1000
PAYLOADS = st.sampled_from([b"", b"ab", b"x" * 125, b"y" * 126, b"z" * MOST])


def masked(opcode: Opcode, payload: bytes, *, fin: bool = True) -> bytes:
    return Frame(opcode, payload, fin).serialize(mask=True)


@st.composite
def said(draw: st.DrawFn) -> tuple[bytes, list[str | bytes]]:
    """What a client sends, and what it means: messages, and pings as their payload behind `ping `."""
    sent, meant = b"", []
    for payload in draw(st.lists(PAYLOADS, max_size=4)):
        is_text = draw(st.booleans())
        opcode = Opcode.TEXT if is_text else Opcode.BINARY
        cuts = sorted(
            {0, len(payload), *(cut % (len(payload) + 1) for cut in draw(st.lists(st.integers(0), max_size=2)))}
        )
        pieces = [payload[start:stop] for start, stop in pairwise(cuts)] or [b""]
        for place, piece in enumerate(pieces):
            sent += masked(opcode if place == 0 else Opcode.CONT, piece, fin=place == len(pieces) - 1)
            if draw(st.booleans()) and place < len(pieces) - 1:
                sent += masked(Opcode.PING, b"inside")
                meant.append(b"ping inside")
        meant.append(payload.decode() if is_text else payload)
        if draw(st.booleans()):
            sent += masked(Opcode.PING, b"between")
            meant.append(b"ping between")
    return sent, meant


def heard(parser: Parser, data: bytes) -> list[str | bytes]:
    return [
        b"ping " + bytes(part.data) if isinstance(part, Frame) else part
        for part in parser.feed(data)
        if not isinstance(part, Frame) or part.opcode is Opcode.PING
    ]


@given(said=said(), cuts=st.lists(st.integers(0, 10**6), max_size=6))
def test_it_finds_what_was_meant(said: tuple[bytes, list[str | bytes]], cuts: list[int]) -> None:
    sent, meant = said
    parser = Parser(most_bytes=MOST)
    places = sorted({0, len(sent), *(cut % (len(sent) + 1) for cut in cuts)})
    found = [part for start, stop in pairwise(places) for part in heard(parser, sent[start:stop])]
    assert found == meant
    assert parser.at_rest
    client = ClientProtocol(parse_uri("ws://x"), state=OPEN)
    client.receive_data(parser.answer())
    assert [b"ping " + bytes(pong.data) for pong in client.events_received()] == [
        part for part in meant if isinstance(part, bytes) and part.startswith(b"ping ")
    ]


@pytest.mark.parametrize(
    "begun",
    [b"\x81", b"\x81\x85\0\0\0\0abc", masked(Opcode.TEXT, b"a", fin=False), b"\x89\x84\0"],
    ids=["header", "payload", "piece", "ping"],
)
def test_it_is_at_rest_only_where_nothing_is_left_unfinished(begun: bytes) -> None:
    parser = Parser(most_bytes=MOST)
    assert list(parser.feed(begun)) == []
    assert not parser.at_rest


@pytest.mark.parametrize(
    ("sent", "code"),
    [
        (masked(Opcode.TEXT, b"\xff"), 1007),
        (masked(Opcode.TEXT, b"\xe2\x82", fin=False) + masked(Opcode.CONT, b"x"), 1007),
        (masked(Opcode.BINARY, b"x" * (MOST + 1)), 1009),
        (masked(Opcode.BINARY, b"x" * MOST, fin=False) + masked(Opcode.CONT, b"x"), 1009),
        (masked(Opcode.CONT, b"x"), 1002),
        (b"\x83\x80\0\0\0\0", 1002),
    ],
)
def test_what_is_wrong_ends_it_with_a_code(sent: bytes, code: int) -> None:
    parser = Parser(most_bytes=MOST)
    assert not [part for part in parser.feed(sent) if isinstance(part, str)]
    assert parser.ends
    assert not parser.agreed
    assert not parser.at_rest
    assert int.from_bytes(parser.answer()[2:4], "big") == code
    assert list(parser.feed(masked(Opcode.TEXT, b"more"))) == []


def test_a_close_is_answered_in_kind() -> None:
    parser = Parser(most_bytes=MOST)
    assert [part.opcode for part in parser.feed(masked(Opcode.CLOSE, b"\x03\xe8bye"))] == [Opcode.CLOSE]
    assert parser.answer() == b"\x88\x05\x03\xe8bye"
    assert parser.ends
    assert parser.agreed


def test_a_close_of_ours_waits_for_its_answer() -> None:
    parser = Parser(most_bytes=MOST)
    parser.close(CloseCode.RESTART, "later")
    parser.close(CloseCode.NORMAL, "a second one is not said")
    assert parser.answer() == b"\x88\x07\x03\xf4later"
    assert not parser.open
    assert not parser.ends
    assert list(parser.feed(masked(Opcode.TEXT, b"on its way"))) == []
    list(parser.feed(masked(Opcode.CLOSE, b"\x03\xf4")))
    assert parser.ends
    assert parser.agreed
