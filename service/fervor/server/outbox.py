"""What waits to be sent to one client: in order, bounded in bytes, sent by one task.

A client that reads too slowly fills its outbox and nobody else's. Who puts into a full outbox is told so and decides.
"""

import asyncio
from collections import deque

from starlette.websockets import WebSocket, WebSocketDisconnect

from fervor.session.events import Close


class Outbox:
    """Messages to one WebSocket."""

    def __init__(self, websocket: WebSocket, *, most_bytes: int) -> None:
        self._websocket = websocket
        self._most_bytes = most_bytes
        self._waiting: deque[str | bytes | Close] = deque()
        self._bytes = 0
        self._something = asyncio.Event()
        self._stuck = False

    @property
    def full(self) -> bool:
        """Whether the client takes no bytes just now, and more waits for it than may."""
        return self._stuck and self._bytes > self._most_bytes

    def put(self, message: str | bytes | Close) -> None:
        """Send this after everything put before; a `Close` is the last."""
        self._waiting.append(message)
        self._bytes += 0 if isinstance(message, Close) else len(message)
        self._something.set()

    def drop(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
        self._bytes = 0

    async def send_all(self) -> None:
        """Send until a close was sent or the client is gone."""
        try:
            while True:
                while self._waiting:
                    message = self._waiting.popleft()
                    if isinstance(message, Close):
                        await self._websocket.close(message.code, message.reason)
                        return
                    self._bytes -= len(message)
                    await self._send(message)
                self._something.clear()
                await self._something.wait()
        except WebSocketDisconnect:
            return

    async def _send(self, message: str | bytes) -> None:
        self._stuck = True  # nobody sees it unless the send has to wait
        if isinstance(message, str):
            await self._websocket.send_text(message)
        else:
            await self._websocket.send_bytes(message)
        self._stuck = False
