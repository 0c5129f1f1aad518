"""What no WebSocket library would send: told by a close code, and not felt by the session beside it."""

import asyncio
import json
import socket
import struct
from collections.abc import Callable
from contextlib import suppress

import pytest

from bodies import motion
from fervor.server.direct_wire import DirectWire
from fervor.server.websocket_protocol import GuardedWebSocket
from fervor.settings import Transport
from live import Live, RawClient, eventually, frames_of, talk

FRAMES = frames_of(motion(40, seed=4))

TEXT, BINARY, CONTINUATION, CLOSE, PING, PONG = 1, 2, 0, 8, 9, 10
FIN, RSV1 = 0x80, 0x40


def piece(opcode: int, payload: bytes = b"", *, flags: int = FIN, masked: bool = True) -> bytes:
    """One small frame as it stands on the wire."""
    assert len(payload) < 126
    mask = b"\0\0\0\0" if masked else b""
    return struct.pack("!BB", flags | opcode, (0x80 if masked else 0) | len(payload)) + mask + payload


def closed_with(sick: RawClient) -> int:
    """The code of the close frame that ends what the service says."""
    sick.socket.settimeout(30)
    received = bytearray()
    with suppress(ConnectionResetError):
        while chunk := sick.socket.recv(1_000_000):
            received += chunk
    start = received.index(b"\x88")
    return int.from_bytes(received[start + 2 : start + 4], "big")


async def beside(service: Live, disturb: Callable[[RawClient], int], **options: str) -> int:
    """What `disturb` returns; a session beside it gets all its estimates, to the bit."""
    async with talk(service) as alone:
        await alone.start(emotion="joy")
        expected = await alone.follow(FRAMES)

    def act() -> int:
        sick = RawClient(service, **options)
        with sick.socket:
            return disturb(sick)

    async with talk(service) as healthy:
        await healthy.start(emotion="joy")
        doing = asyncio.create_task(asyncio.to_thread(act))
        before = await healthy.follow(FRAMES[:20])
        done = await doing
        assert before + await healthy.follow(FRAMES[20:]) == expected
    await eventually(lambda: service.service.sessions.open == 0)
    await eventually(lambda: service.service.connections.open == 0)
    return done


BROKEN = {
    "compressed, which was not agreed on": (piece(TEXT, b"abc", flags=FIN | RSV1), 1002),
    "not masked": (piece(TEXT, b"{}", masked=False), 1002),
    "an opcode that is not there": (piece(3), 1002),
    "a continuation of nothing": (piece(CONTINUATION, b"x"), 1002),
    "a message inside a message": (piece(TEXT, b"{", flags=0) + piece(TEXT, b"{}"), 1002),
    "a ping in pieces": (piece(PING, b"x", flags=0), 1002),
    "a ping of 126 bytes": (struct.pack("!BBH", FIN | PING, 0x80 | 126, 126) + b"\0" * 130, 1002),
    "no UTF-8": (piece(TEXT, b"\xff\xfe"), 1007),
    "half a character, in pieces": (piece(TEXT, b"\xe2\x82", flags=0) + piece(CONTINUATION, b"x"), 1007),
    "a length with the first bit set": (struct.pack("!BBQ", FIN | TEXT, 0xFF, 1 << 63) + b"\0" * 4, 1009),
    "sixteen exabytes, almost": (struct.pack("!BBQ", FIN | TEXT, 0xFF, (1 << 63) - 1) + b"\0" * 4, 1009),
}


@pytest.mark.parametrize(("sent", "code"), BROKEN.values(), ids=BROKEN)
async def test_what_is_no_websocket_is_closed_with_its_code(sent: bytes, code: int, start_service) -> None:
    def send(sick: RawClient) -> int:
        sick.socket.sendall(sent)
        return closed_with(sick)

    assert await beside(start_service(), send) == code


@pytest.mark.parametrize("header", ["Sec-WebSocket-Key: short", "X-Key: none", "Sec-WebSocket-Version: 7"])
def test_a_handshake_that_is_none_is_told_as_a_problem(header: str, live: Live) -> None:
    host, port = live.address.split(":")
    request = RawClient.UPGRADE.format(live.address, "fervor.v1.json")
    replaced = "Sec-WebSocket-Version: 13" if "Version" in header else "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="
    with socket.create_connection((host, int(port)), timeout=30) as connection:
        connection.sendall(request.replace(replaced, header).encode())
        received = b""
        while chunk := connection.recv(65536):
            received += chunk
    head, _, body = received.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400 ")
    assert b"content-type: application/problem+json" in head.lower()
    assert json.loads(body)["detail"].startswith("Failed to open a WebSocket connection")


async def test_a_message_in_endless_pieces_is_cut_at_the_limit(start_service) -> None:
    def send(sick: RawClient) -> int:
        with suppress(OSError):
            sick.socket.sendall(piece(TEXT, b"{", flags=0))
            while True:
                sick.socket.sendall(struct.pack("!BBH", CONTINUATION, 0xFE, 1000) + b"\0" * 4 + b"x" * 1000)
        return closed_with(sick)

    assert await beside(start_service(max_message_bytes=50_000), send) == 1009


@pytest.mark.parametrize("small", [PING, PONG, CONTINUATION], ids=["pings", "pongs", "empty pieces"])
async def test_a_flood_of_small_frames_is_closed_with_4429(small: int, start_service) -> None:
    def flood(sick: RawClient) -> int:
        if small == CONTINUATION:
            sick.socket.sendall(piece(TEXT, b"{", flags=0))
        with suppress(OSError):
            while True:
                sick.socket.sendall(piece(small, flags=0 if small == CONTINUATION else FIN) * 1000)
        return closed_with(sick)

    service = start_service(max_frames_per_second=500, max_frames_per_message=500)
    assert await beside(service, flood) == 4429


async def test_pongs_do_not_pile_up_for_a_client_that_reads_nothing(start_service) -> None:
    service = start_service(max_frames_per_second=1e9, max_frames_per_message=4096)
    deaf = RawClient(service)

    def flood() -> None:
        with suppress(OSError, TimeoutError):
            deaf.socket.settimeout(5)
            for _ in range(2000):
                deaf.socket.sendall(piece(PING, b"p" * 100) * 100)

    with deaf.socket:
        async with talk(service) as healthy:
            await healthy.start()
            flooding = asyncio.create_task(asyncio.to_thread(flood))
            assert len(await healthy.follow(FRAMES)) == len(FRAMES)
            await flooding
            waiting = [c.transport.get_write_buffer_size() for c in live_connections(service)]
    # Of 20 MB that were asked for: what it takes to count as stuck, and the answers to what one read brings.
    assert max(waiting) <= 65_536 + 262_144


def live_connections(service: Live) -> list:
    return [connection for connection in service._server.server_state.connections if connection.transport]


async def test_a_client_that_never_shakes_hands_is_shown_the_door(start_service) -> None:
    service = start_service(start_timeout_s=0.3)

    def wait(sick: RawClient) -> int:
        return closed_with(sick)

    assert await beside(service, wait) == 4408


async def test_who_never_takes_his_close_is_cut(start_service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor.server.life.CLOSE_GRACE_S", 0.2)
    monkeypatch.setattr("fervor.server.websocket_protocol.LEFT_BEHIND_S", 0.2)
    monkeypatch.setattr("fervor.server.direct_wire.LEFT_BEHIND_S", 0.2)
    service = start_service(max_unsent_bytes=100_000, max_frames_per_second=1e9)
    deaf = RawClient(service)
    with deaf.socket:
        with suppress(ConnectionError):  # that it is cut may show before all is sent
            await asyncio.to_thread(deaf.fall_deaf)
        await eventually(lambda: service.service.connections.open == 0)
    assert service.service.sessions.open == 0


async def test_a_half_open_peer_costs_its_own_session_only(start_service) -> None:
    def vanish(sick: RawClient) -> int:
        sick.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        sick.socket.sendall(piece(TEXT, b'{"type": "pi', flags=0))
        sick.socket.close()  # a reset, in the middle of a message
        return 0

    assert await beside(start_service(), vanish) == 0


async def test_text_on_msgpack_is_told_and_survived(start_service) -> None:
    service = start_service()

    def speak(sick: RawClient) -> int:
        sick.send(b"\x81\xa4type\xadsession.start", opcode=BINARY)
        sick.read_until(b"session.started")
        sick.send(b'{"type": "ping"}', opcode=TEXT)
        sick.read_until(b"takes binary messages, but 16 characters of text came")
        sick.send(b"\x82\xa4type\xa4ping\xa2id\xa3abc", opcode=BINARY)
        assert sick.read_until(b"abc").endswith(b"abc")
        return 0

    assert await beside(service, speak, subprotocol="fervor.v1.msgpack") == 0


async def test_a_connection_takes_the_way_that_was_set(live: Live, transport: Transport) -> None:
    async with talk(live) as stream:
        await stream.start()
        (connection,) = live_connections(live)
        assert isinstance(connection, DirectWire if transport == "direct" else GuardedWebSocket)


async def test_bytes_that_come_one_by_one_change_no_bit(start_service) -> None:
    service = start_service()
    messages = [{"type": "session.start", "emotion": "joy"}, *({"type": "frame", **frame} for frame in FRAMES[:3])]
    async with talk(service) as stream:
        await stream.start(emotion="joy")
        expected = await stream.follow(FRAMES[:3])

    def dribble(sick: RawClient) -> bytes:
        sick.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for message in messages:
            payload = json.dumps(message).encode()
            for byte in struct.pack("!BBH", FIN | TEXT, 0xFE, len(payload)) + b"\0\0\0\0" + payload:
                sick.socket.sendall(bytes([byte]))
        return sick.read_until(b'"seq":2,')

    sick = RawClient(service)
    with sick.socket:
        received = await asyncio.to_thread(dribble, sick)
    for estimate in expected[:2]:
        assert json.dumps(estimate, separators=(",", ":")).encode() in received


async def test_pings_between_and_inside_messages_are_answered(start_service) -> None:
    def mix(sick: RawClient) -> int:
        start = json.dumps({"type": "session.start"}).encode()
        halves = piece(TEXT, start[:9], flags=0), piece(CONTINUATION, start[9:])
        sick.socket.sendall(halves[0] + piece(PING, b"inside") + halves[1])
        assert b"inside" in sick.read_until(b"session.started")
        question = piece(TEXT, b'{"type":"ping","id":"between"}')
        sick.socket.sendall(piece(PING, b"before") + question + piece(PING, b"after"))
        said = sick.read_until(b"after")
        assert said.index(b"before") < said.index(b"after")
        if b"between" not in said:
            sick.read_until(b"between")
        return 0

    assert await beside(start_service(), mix) == 0
