"""However a client's bytes are cut up on their way: the same messages as a complete parser finds, the same refusals."""

import struct
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.protocol import OPEN
from websockets.server import ServerProtocol
from websockets.uri import parse_uri

from fervor.server.cutter import Cutter, Message, as_frame, whole

MOST = 70_000

SIZES = st.sampled_from([0, 1, 5, 125, 126, 127, 1000, 65535, 65536, MOST, MOST + 1])
MASKS = st.binary(min_size=4, max_size=4)


def frame(first: int, payload: bytes, mask: bytes | None) -> bytes:
    """A frame as it stands on the wire, right or wrong."""
    masked = 0 if mask is None else 0x80
    if len(payload) < 126:
        head = struct.pack("!BB", first, masked | len(payload))
    elif len(payload) < 65536:
        head = struct.pack("!BBH", first, masked | 126, len(payload))
    else:
        head = struct.pack("!BBQ", first, masked | 127, len(payload))
    key = mask or bytes(4)
    body = bytes(byte ^ key[index % 4] for index, byte in enumerate(payload))
    return head + (mask or b"") + body


FRAMES = st.builds(
    lambda first, size, mask: frame(first, bytes(range(256)) * (size // 256) + b"z" * (size % 256), mask),
    st.sampled_from([0x81, 0x82, 0x81, 0x82, 0x01, 0x02, 0x00, 0x80, 0x89, 0x8A, 0x88, 0xC1, 0x83, 0x09]),
    SIZES,
    MASKS | st.none(),
)
STREAMS = st.lists(FRAMES, max_size=5).map(b"".join) | st.binary(max_size=200)


class Parser:
    """websockets' own parser, and what it found."""

    def __init__(self) -> None:
        self._protocol = ServerProtocol(state=OPEN, max_size=MOST)
        self.found: list[tuple[Opcode, bool, bytes]] = []

    def feed(self, data: bytes) -> None:
        self._protocol.receive_data(data)
        for event in self._protocol.events_received():
            assert isinstance(event, Frame)
            self.found.append((event.opcode, event.fin, bytes(event.data)))

    @property
    def failed(self) -> str:
        return str(self._protocol.parser_exc)

    @property
    def open(self) -> bool:
        return self._protocol.state is OPEN


def pieces(data: bytes, cuts: list[int]) -> list[bytes]:
    places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[start:stop] for start, stop in pairwise(places)]


@given(stream=STREAMS, cuts=st.lists(st.integers(0, 10**6), max_size=6))
def test_it_finds_what_a_complete_parser_finds(stream: bytes, cuts: list[int]) -> None:
    complete = Parser()
    complete.feed(stream)
    rest, cutter = Parser(), Cutter(most_bytes=MOST)
    for piece in pieces(stream, cuts):
        for part in _parts(cutter, piece):
            if isinstance(part, bytes):
                rest.feed(part)
            elif rest.open:  # a parser that has failed, or was told good-bye, takes nothing more
                rest.found.append((Opcode.TEXT if part.is_text else Opcode.BINARY, True, part.payload))
    assert rest.found == complete.found
    assert rest.failed == complete.failed


def _parts(cutter: Cutter, piece: bytes) -> list[Message | bytes]:
    """The parts of a piece, by the fast way where it may be taken."""
    message = whole(piece, MOST) if cutter.at_rest else None
    if message is None:
        return list(cutter.cut(piece))
    return [Message(message.encode() if isinstance(message, str) else message, is_text=isinstance(message, str))]


def test_a_whole_message_never_reaches_the_complete_parser() -> None:
    stream = frame(0x81, b"one", b"abcd") + frame(0x82, b"two" * 100, b"efgh")
    assert list(Cutter(most_bytes=MOST).cut(stream)) == [
        Message(b"one", is_text=True),
        Message(b"two" * 100, is_text=False),
    ]


def test_what_comes_alone_and_whole_is_found_without_cutting() -> None:
    for payload in (b"", b"two", b"x" * 125, b"x" * 126, b"x" * 65_535):
        assert whole(frame(0x82, payload, b"efgh"), MOST) == payload
        assert whole(frame(0x81, payload, b"efgh"), MOST) == payload.decode()
    assert whole(frame(0x81, "größer".encode(), b"efgh"), MOST) == "größer"


@pytest.mark.parametrize(
    "other",
    [
        b"",
        b"\x82",
        frame(0x82, b"bare", None),
        frame(0x82, b"", b"efgh")[:-1],
        frame(0x82, b"x" * 126, b"efgh")[:7],
        frame(0x82, b"one", b"efgh") + b"\x82",
        frame(0x02, b"a piece", b"efgh"),
        frame(0x89, b"ping", b"efgh"),
        frame(0xC1, b"compressed", b"efgh"),
        frame(0x81, b"\xff\xfe", b"efgh"),
        frame(0x82, b"x" * 65_536, b"efgh"),
        frame(0x82, b"x" * 1001, b"efgh"),
    ],
)
def test_all_else_is_left_to_be_cut(other: bytes) -> None:
    assert whole(other, 1000) is None


@given(message=st.text() | st.binary() | st.sampled_from([125, 126, 65_535, 65_536]).map(bytes))
def test_a_frame_made_is_read_as_its_message(message: str | bytes) -> None:
    client = ClientProtocol(parse_uri("ws://x"), state=OPEN, max_size=None)
    client.receive_data(as_frame(message))
    (event,) = client.events_received()
    assert isinstance(event, Frame)
    assert event.fin
    assert event.opcode is (Opcode.TEXT if isinstance(message, str) else Opcode.BINARY)
    assert event.data == (message.encode() if isinstance(message, str) else message)


def test_after_a_frame_that_was_passed_on_it_finds_messages_again() -> None:
    ping, text = frame(0x89, b"?", b"abcd"), frame(0x81, b"hello", b"efgh")
    cutter = Cutter(most_bytes=MOST)
    assert list(cutter.cut(ping + text[:7])) == [ping, text[:7]]
    assert list(cutter.cut(text[7:] + ping + text)) == [text[7:], ping, Message(b"hello", is_text=True)]


@pytest.mark.parametrize("wrong", [b"\x81\x02{}", b"\xc1\x80", b"\x83\x80", b"\x89\xfe"])
def test_what_is_wrong_is_passed_on_at_its_second_byte(wrong: bytes) -> None:
    assert list(Cutter(most_bytes=MOST).cut(wrong)) == [wrong]
