"""The connections of an async session, one after the other: opened, read, written, and opened again after a cut."""

import asyncio
import contextlib
from typing import Self

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed, WebSocketException

from fervor.errors import FervorError, Unreachable
from fervor_client.base import BaseSession, OnError, OnReconnect
from fervor_client.conversation import Conversation
from fervor_client.dialling import Way
from fervor_client.failures import check_subprotocol, closed, refused


class Connected(BaseSession):
    """A session's connections. One task reads; whoever has something to send writes, one at a time."""

    def __init__(
        self, way: Way, conversation: Conversation, *, window: int, on_error: OnError, on_reconnect: OnReconnect
    ) -> None:
        super().__init__(way, conversation, window=window, on_error=on_error, on_reconnect=on_reconnect)
        self._socket: ClientConnection | None = None
        self._news = asyncio.Condition()
        self._runner: asyncio.Task[None] | None = None
        self._backlog: asyncio.Task[None] | None = None

    async def start(self) -> Self:
        """Open the session. `connect` does it.

        Raises:
            FervorError: no service is there, or it refused.
        """
        try:
            failure = await self._dial()
            if failure is not None:
                self._conversation.lost(failure)
            self._conversation.must_be_open()
        except BaseException:
            await self._hang_up()
            raise
        self._runner = asyncio.create_task(self._run(), name="fervor-client")
        return self

    async def close(self) -> None:
        """Close the connection now, whatever is under way."""
        self._conversation.lost(None)
        if self._runner is not None:
            self._runner.cancel()
            await asyncio.wait([self._runner])

    async def _pump(self) -> None:
        """Send what is to be sent, unless somebody is at it: then they will send this too."""
        if self._pumping:
            return
        self._pumping = True
        try:
            while (payload := self._conversation.next_payload()) is not None:
                assert self._socket is not None, "a payload is given for a connection only"
                with contextlib.suppress(ConnectionClosed):  # the reader sees it too, and knows why
                    await self._socket.send(payload)
                if pause := self._conversation.pause_s:
                    await asyncio.sleep(pause)
        except asyncio.CancelledError:  # the caller's; what others queued must leave all the same
            self._pumping = False
            self._send_backlog()
            raise
        finally:
            self._pumping = False

    def _send_backlog(self) -> None:
        if not self._conversation.over:
            self._backlog = asyncio.create_task(self._pump(), name="fervor-client-backlog")

    async def _run(self) -> None:
        """Read until the session is over, through as many connections as it takes."""
        try:
            while True:
                failure: FervorError | None = await self._talk()
                while failure is not None:
                    if not await self._wait(failure):
                        return
                    failure = await self._dial()
                self._send_backlog()
        finally:
            self._conversation.lost(Unreachable("the client stopped reading"))
            if self._backlog is not None:
                self._backlog.cancel()
            await self._hang_up()
            async with self._news:
                self._news.notify_all()

    async def _talk(self) -> FervorError:
        """Read until the connection is gone or the session over; why."""
        try:
            while self._conversation.linked:
                await self._read_one()
        except ConnectionClosed as error:
            return closed(error, self._way.shown, unanswered=self.in_flight)
        finally:
            await self._hang_up()
        return Unreachable(f"the session with {self._way.shown} is over")

    async def _wait(self, failure: FervorError) -> bool:
        """Wait until it is time to connect again; whether it is worth it."""
        async with self._news:
            plan = self._conversation.interrupted(failure)
            self._news.notify_all()
        if plan is None or plan.delay_s is None:
            return False
        self._tell([plan])
        await asyncio.sleep(plan.delay_s)
        return True

    async def _dial(self) -> FervorError | None:
        """Connect, then start the session or resume it; why that failed, unless the service told the conversation."""
        try:
            async with asyncio.timeout(self._way.timeout_s):
                self._socket = await self._way.open_async()
                check_subprotocol(self._socket.subprotocol, self._way.shown)
                await self._socket.send(self._conversation.start())
                while self._conversation.linking:
                    await self._read_one()
        except FervorError as error:
            failure = error
        except (OSError, EOFError, WebSocketException) as error:
            failure = refused(error, self._way.shown)
            failure.__cause__ = error
        else:
            return None
        await self._hang_up()
        return failure

    async def _hang_up(self) -> None:
        if self._socket is not None:
            await self._socket.close()

    async def _read_one(self) -> None:
        assert self._socket is not None, "only a connection is read"
        try:
            async with asyncio.timeout(self._quiet_s()) as quiet:
                payload = await self._socket.recv()
        except TimeoutError:
            if not quiet.expired():
                raise
            await self._socket.send(self._conversation.ping())
            return
        async with self._news:
            news = self._conversation.receive(payload)
            self._news.notify_all()
        self._tell(news)
