"""What a conversation needs of a connection, whoever carries it: messages in and out, in order, and a close.

Two ways lead to a client. The ordinary one is ASGI's, a task that waits on either side of the conversation; any server
can carry it. The direct one is a shortcut that only our own protocol class offers: a message is taken in the turn of
the event loop in which its bytes came, and an answer is written in the turn in which it is known, by plain calls.
Whatever can't be done at once goes the ordinary way, and so do all handshakes and closes.
"""

from collections.abc import Callable
from typing import Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect

Take = Callable[[str | bytes], bool]
"""Takes a message at once; False, having done nothing, where it can't."""

EXTENSION = "fervor"
"""Where a connection that offers the shortcut stands among the extensions of an ASGI scope."""


class Shortcut(Protocol):
    """A connection that can do without ASGI."""

    take: Take | None
    """To be called with every message that comes before it goes the ordinary way; None: there is nobody yet."""

    def write(self, message: str | bytes) -> bool:
        """Send a message at once; False, having done nothing, where the client is gone or takes none just now."""


class Wire(Protocol):
    """One WebSocket. All but `receive` raise ConnectionError where the client is gone."""

    async def receive(self) -> str | bytes | None:
        """The next message; None once the client is gone."""

    def listen(self, take: Take) -> None:
        """Offer messages to `take` first, where the wire can; what it takes, `receive` does not give."""

    async def send(self, message: str | bytes) -> None:
        """Send a message; waits while the client takes none."""

    def write(self, message: str | bytes) -> bool:
        """Send a message at once; False, having done nothing, where the wire can't: then `send` may."""

    async def close(self, code: int, reason: str) -> None:
        """Close, after everything that was sent."""


class StarletteWire:
    """A Starlette WebSocket as a wire."""

    def __init__(self, websocket: WebSocket) -> None:
        self._websocket = websocket

    def listen(self, take: Take) -> None:
        """See `Wire`: it can't."""

    def write(self, message: str | bytes) -> bool:  # noqa: ARG002  # see `Wire`
        """See `Wire`: it can't."""
        return False

    async def receive(self) -> str | bytes | None:
        """See `Wire`."""
        event = await self._websocket.receive()
        if event["type"] == "websocket.disconnect":
            return None
        text: str | None = event.get("text")
        data: bytes | None = event.get("bytes")
        return data if text is None else text

    async def send(self, message: str | bytes) -> None:
        """See `Wire`."""
        try:
            if isinstance(message, str):
                await self._websocket.send_text(message)
            else:
                await self._websocket.send_bytes(message)
        except WebSocketDisconnect as error:
            raise ConnectionError from error

    async def close(self, code: int, reason: str) -> None:
        """See `Wire`."""
        try:
            await self._websocket.close(code, reason)
        except WebSocketDisconnect as error:
            raise ConnectionError from error


class DirectWire(StarletteWire):
    """A Starlette WebSocket with a shortcut beside it."""

    def __init__(self, websocket: WebSocket, shortcut: Shortcut) -> None:
        super().__init__(websocket)
        self._shortcut = shortcut

    def listen(self, take: Take) -> None:
        """See `Wire`."""
        self._shortcut.take = take

    def write(self, message: str | bytes) -> bool:
        """See `Wire`."""
        return self._shortcut.write(message)


def wire_to(websocket: WebSocket) -> Wire:
    """The best wire that the server of an accepted WebSocket offers."""
    shortcut: Shortcut | None = websocket.scope.get("extensions", {}).get(EXTENSION)
    return StarletteWire(websocket) if shortcut is None else DirectWire(websocket, shortcut)
