"""A connection after its handshake: nothing of the handshake stays, nothing waits, and it ends as it should."""

import asyncio
import gc
import socket
import struct
from contextlib import AsyncExitStack

import pytest
from starlette.requests import HTTPConnection
from websockets.server import ServerProtocol

from bodies import motion
from fervor.server.conversation import Conversation
from fervor.server.direct_wire import DirectWire
from fervor.server.http_protocol import GuardedHttp
from fervor.server.websocket_protocol import GuardedWebSocket
from fervor.session.body import Body
from fervor.session.following import Following
from fervor.session.session import Session
from live import Live, RawClient, eventually, frames_of, running, talk

FRAMES = frames_of(motion(20))
OF_A_HANDSHAKE = (GuardedHttp, GuardedWebSocket, HTTPConnection, ServerProtocol, asyncio.Task, asyncio.Queue)


@pytest.fixture
def service():
    with running(transport="direct", max_frames_per_second=1e6) as live:
        yield live


def wires(service: Live) -> list[DirectWire]:
    return [connection for connection in service._server.server_state.connections if isinstance(connection, DirectWire)]


def loop_of(service: Live) -> asyncio.AbstractEventLoop:
    """Of the service, which has a conversation."""
    conversation, *_ = service.service.drain.talking
    return conversation._loop


def held() -> list:
    """Everything there is of what a handshake needs, but the tasks of the clients in this test."""
    gc.collect()
    things = [thing for thing in gc.get_objects() if issubclass(type(thing), OF_A_HANDSHAKE)]
    clients = asyncio.get_running_loop()
    return [thing for thing in things if not (isinstance(thing, asyncio.Task) and thing.get_loop() is clients)]


async def test_an_open_session_holds_nothing_of_its_handshake(service: Live) -> None:
    async with AsyncExitStack() as stack:
        first = await stack.enter_async_context(talk(service))
        await first.start(emotion="joy")
        await eventually(lambda: not service._server.server_state.tasks)
        before = held()
        for _ in range(5):
            stream = await stack.enter_async_context(talk(service))
            await stream.start(emotion="joy")
            assert len(await stream.follow(FRAMES)) == len(FRAMES)
        await eventually(lambda: not service._server.server_state.tasks)
        assert len(wires(service)) == 6
        assert [thing for thing in held() if not any(thing is other for other in before)] == []


OF_A_SESSION = (*OF_A_HANDSHAKE[:2], DirectWire, Conversation, Session, Following, Body)


async def test_a_session_leaves_nothing_to_the_collector(service: Live) -> None:
    """So that it may look seldom: what it finds it finds by stopping all streams."""

    def left() -> list:
        return [thing for thing in gc.get_objects() if issubclass(type(thing), OF_A_SESSION)]

    gc.collect()
    gc.disable()
    try:
        before = len(left())
        for leaves in (True, False):
            async with talk(service) as stream:
                await stream.start(emotion="joy")
                assert len(await stream.follow(FRAMES)) == len(FRAMES)
                if leaves:
                    await stream.send("session.end")
                    assert (await stream.hear())["type"] == "session.ended"
        await eventually(lambda: len(left()) <= before)
    finally:
        gc.enable()


async def test_a_session_has_no_task_of_its_own(service: Live) -> None:
    async with talk(service) as first:
        await first.start()
        loop = loop_of(service)
        await eventually(lambda: not service._server.server_state.tasks)
        alone = len(asyncio.all_tasks(loop))
        async with AsyncExitStack() as stack:
            for _ in range(5):
                stream = await stack.enter_async_context(talk(service))
                await stream.start()
                assert len(await stream.follow(FRAMES)) == len(FRAMES)
            await eventually(lambda: not service._server.server_state.tasks)
            assert len(service.service.drain.talking) == 6
            assert len(asyncio.all_tasks(loop)) == alone


async def test_the_complete_parser_is_there_only_while_there_is_need(service: Live) -> None:
    client = RawClient(service)
    with client.socket:
        await eventually(lambda: len(service.service.drain.talking) == 1)
        (wire,) = wires(service)
        assert wire._parser is None
        client.socket.sendall(b"\x89\x84\0\0\0\0ping")
        assert await asyncio.to_thread(client.read_until, b"\x8a\x04ping")
        await eventually(lambda: wire._parser is None)
        client.socket.sendall(b'\x01\x88\0\0\0\0{"type":')
        await eventually(lambda: wire._parser is not None)
        client.socket.sendall(b'\x80\x87\0\0\0\0"ping"}')
        assert await asyncio.to_thread(client.read_until, b'{"type":"pong"}')
        await eventually(lambda: wire._parser is None)


@pytest.mark.parametrize("answers", [True, False])
async def test_a_client_that_answers_no_ping_is_closed(answers: bool, service: Live) -> None:
    client = RawClient(service)
    with client.socket:
        await eventually(lambda: len(service.service.drain.talking) == 1)
        (wire,) = wires(service)
        loop = loop_of(service)
        later = loop.time() + 21.0  # seconds; uvicorn has a client pinged every 20
        loop.call_soon_threadsafe(wire.look, later)
        received = await asyncio.to_thread(client.read_until, b"\x89\x04")
        while len(received) < 6:
            received += await asyncio.to_thread(client.socket.recv, 6 - len(received))
        if answers:
            client.socket.sendall(b"\x8a\x84\0\0\0\0" + received[2:])
            await eventually(lambda: wire._pinged is None)
        loop.call_soon_threadsafe(wire.look, later + 21.0)
        if answers:
            assert await asyncio.to_thread(client.read_until, b"\x89\x04")
        else:
            assert await asyncio.to_thread(client.read_until, struct.pack("!H", 1011) + b"keepalive ping timeout")
            await eventually(lambda: service.service.sessions.open == 0)


async def test_a_connection_that_is_lost_in_its_handshake_leaves_nothing(service: Live) -> None:
    for _ in range(20):
        with socket.create_connection(service.address.split(":")) as client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closes with a reset
            client.sendall(RawClient.UPGRADE.format(service.address, "fervor.v1.json").encode())
    await eventually(lambda: service.service.connections.open == 0)
    await eventually(lambda: service.service.sessions.open == 0)
    assert not service._server.server_state.connections
