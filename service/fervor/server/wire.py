"""What a conversation needs of a connection, whoever carries it: messages in and out, in order, and a close."""

from typing import Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect


class Wire(Protocol):
    """One WebSocket. All but `receive` raise ConnectionError where the client is gone."""

    async def receive(self) -> str | bytes | None:
        """The next message; None once the client is gone."""

    async def send(self, message: str | bytes) -> None:
        """Send a message; waits while the client takes none."""

    async def close(self, code: int, reason: str) -> None:
        """Close, after everything that was sent."""


class StarletteWire:
    """A Starlette WebSocket as a wire."""

    def __init__(self, websocket: WebSocket) -> None:
        self._websocket = websocket

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
