"""A Starlette WebSocket as a wire: in order, one at a time, and an end for each way it can come."""

import asyncio
from typing import Any

from starlette.websockets import WebSocket

from fervor.errors import CloseCode
from fervor.server.asgi_wire import AsgiWire

SCOPE = {"type": "websocket", "path": "/", "headers": [], "extensions": {}}


class Server:
    """The other side of ASGI: what it has received, and takes when told to."""

    def __init__(self) -> None:
        self.events: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.sent: list[dict[str, Any]] = []
        self.takes = asyncio.Event()
        self.takes.set()
        self.fault: Exception | None = None

    async def send(self, event) -> None:
        if self.fault is not None:
            raise self.fault
        await self.takes.wait()
        self.sent.append({key: value for key, value in event.items() if value is not None})

    def bring(self, message: str | bytes) -> None:
        kind = "text" if isinstance(message, str) else "bytes"
        self.events.put_nowait({"type": "websocket.receive", kind: message})

    def hang_up(self) -> None:
        self.events.put_nowait({"type": "websocket.disconnect", "code": 1000})


class Heard:
    """A listener that remembers."""

    def __init__(self) -> None:
        self.messages: list[str | bytes] = []
        self.writable_count = 0
        self.losses = 0

    def came(self, message: str | bytes) -> None:
        self.messages.append(message)

    def writable(self) -> None:
        self.writable_count += 1

    def lost(self) -> None:
        self.losses += 1


async def accepted(server: Server) -> AsgiWire:
    websocket = WebSocket(SCOPE, server.events.get, server.send)
    server.events.put_nowait({"type": "websocket.connect"})
    await websocket.accept()
    server.sent.clear()
    return AsgiWire(websocket)


async def turns(count: int = 5) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


async def test_messages_are_brought_until_the_client_is_gone() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    server.bring("text")
    server.bring(b"bytes")
    server.hang_up()
    await wire.carry(heard)
    assert heard.messages == ["text", b"bytes"]
    assert heard.losses == 1


async def test_one_message_is_on_its_way_and_the_next_is_asked_for() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    carrying = asyncio.create_task(wire.carry(heard))
    await turns()
    server.takes.clear()
    assert wire.write("one")
    assert not wire.write("two")
    assert not wire.stuck  # nobody has tried yet
    await turns()
    assert wire.stuck
    assert heard.writable_count == 0
    server.takes.set()
    await turns()
    assert not wire.stuck
    assert heard.writable_count == 1
    assert wire.write(b"two")
    await turns()
    assert wire.close(CloseCode.NORMAL, "done")
    await turns()
    assert server.sent == [
        {"type": "websocket.send", "text": "one"},
        {"type": "websocket.send", "bytes": b"two"},
        {"type": "websocket.close", "code": 1000, "reason": "done"},
    ]
    assert wire._sender is None
    server.hang_up()
    await carrying


async def test_nothing_is_brought_while_reading_pauses() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    carrying = asyncio.create_task(wire.carry(heard))
    server.bring("one")
    await turns()
    wire.pause()
    server.bring("two")
    server.bring("three")
    await turns()
    assert heard.messages == ["one", "two"]  # the second was waited for already
    wire.resume()
    server.hang_up()
    await carrying
    assert heard.messages == ["one", "two", "three"]


async def test_a_conversation_that_leaves_ends_the_call_and_what_is_on_its_way() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    carrying = asyncio.create_task(wire.carry(heard))
    await turns()
    server.takes.clear()
    wire.write("never taken")
    await turns()
    wire.leave()
    await carrying
    assert server.sent == []
    assert heard.losses == 1


async def test_a_client_that_is_gone_takes_nothing_more() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    carrying = asyncio.create_task(wire.carry(heard))
    await turns()
    server.fault = OSError("gone")
    assert wire.write("one")
    await turns()
    assert not wire.write("two")
    assert heard.writable_count == 0
    server.hang_up()
    await carrying
    assert heard.losses == 1


async def test_a_server_that_fails_costs_this_conversation() -> None:
    server, heard = Server(), Heard()
    wire = await accepted(server)
    carrying = asyncio.create_task(wire.carry(heard))
    await turns()
    server.fault = RuntimeError("a fault")
    wire.write("one")
    await carrying
    assert heard.losses == 1
