"""A Starlette WebSocket as a wire: the way that any ASGI server can carry."""

import asyncio
import logging

from starlette.websockets import WebSocket, WebSocketDisconnect

from fervor.errors import CloseCode
from fervor.server.wire import Listener
from fervor.session.events import Close

log = logging.getLogger(__name__)


class AsgiWire:
    """See `Wire`. One message at a time is on its way; a task sends while there is one."""

    def __init__(self, websocket: WebSocket) -> None:
        self._websocket = websocket
        self._listener: Listener | None = None
        self._patience = asyncio.timeout(None)
        self._pause: asyncio.Future[None] | None = None  # while nothing is to be read
        self._next: str | bytes | Close | None = None
        self._sender: asyncio.Task[None] | None = None
        self.stuck = False
        """See `Wire`."""

    async def carry(self, listener: Listener) -> None:
        """See `Wire`; returns when the conversation is over."""
        self._listener = listener
        try:
            async with self._patience:
                while (message := await self._receive()) is not None:
                    listener.came(message)
                    if self._pause is not None:
                        await self._pause
        except TimeoutError:
            pass  # the conversation has left
        finally:
            self._listener = None
            listener.lost()
            if self._sender is not None:
                self._sender.cancel()
                await asyncio.gather(self._sender, return_exceptions=True)

    def write(self, message: str | bytes) -> bool:
        """See `Wire`."""
        return self._put(message)

    def close(self, code: CloseCode, reason: str) -> bool:
        """See `Wire`."""
        return self._put(Close(code, reason))

    def pause(self) -> None:
        """See `Wire`."""
        if self._pause is None:
            self._pause = asyncio.get_running_loop().create_future()

    def resume(self) -> None:
        """See `Wire`."""
        if self._pause is not None:
            if not self._pause.done():
                self._pause.set_result(None)
            self._pause = None

    def leave(self) -> None:
        """See `Wire`."""
        if self._listener is not None:
            self._listener = None
            self._patience.reschedule(asyncio.get_running_loop().time())

    def look(self, now: float) -> None:
        """See `Wire`: the server looks by itself."""

    def _put(self, message: str | bytes | Close) -> bool:
        if self._next is not None:
            return False
        self._next = message
        if self._sender is None:
            self._sender = asyncio.create_task(self._send_all())
        return True

    async def _send_all(self) -> None:
        """Send what is put, until nothing is."""
        try:
            while self._next is not None:
                self.stuck = True  # nobody sees it unless the send has to wait
                await self._send(self._next)
                self.stuck = False
                self._next = None
                if self._listener is not None:
                    self._listener.writable()
        except WebSocketDisconnect:
            return  # and nothing more is taken; `carry` hears of it, too
        except Exception:  # it costs this session, and no other
            log.exception("could not send")
            self.leave()
        self._sender = None

    async def _send(self, message: str | bytes | Close) -> None:
        if isinstance(message, Close):
            await self._websocket.close(message.code, message.reason)
        elif isinstance(message, str):
            await self._websocket.send_text(message)
        else:
            await self._websocket.send_bytes(message)

    async def _receive(self) -> str | bytes | None:
        """The next message; None once the client is gone."""
        event = await self._websocket.receive()
        if event["type"] == "websocket.disconnect":
            return None
        text: str | None = event.get("text")
        data: bytes | None = event.get("bytes")
        return data if text is None else text
