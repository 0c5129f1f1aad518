"""The connections of a session for threads, one after the other; the twin of `aio_connection`."""

import contextlib
import threading
import time
from typing import Self

from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import ClientConnection

from fervor.errors import FervorError, Unreachable
from fervor_client.base import BaseSession, OnError, OnReconnect
from fervor_client.conversation import Conversation
from fervor_client.dialling import CLOSE_TIMEOUT_S, Way
from fervor_client.failures import check_subprotocol, closed, refused


class Connected(BaseSession):
    """A session's connections. One thread reads; whoever has something to send writes, one at a time."""

    def __init__(
        self, way: Way, conversation: Conversation, *, window: int, on_error: OnError, on_reconnect: OnReconnect
    ) -> None:
        super().__init__(way, conversation, window=window, on_error=on_error, on_reconnect=on_reconnect)
        self._socket: ClientConnection | None = None
        self._news = threading.Condition()  # guards the conversation, and which socket is its own
        self._reader = threading.Thread(target=self._run, name="fervor-client", daemon=True)

    def start(self) -> Self:
        """Open the session. `connect` does it.

        Raises:
            FervorError: no service is there, or it refused.
        """
        try:
            failure = self._dial()
            with self._news:
                if failure is not None:
                    self._conversation.lost(failure)
                self._conversation.must_be_open()
        except BaseException:
            self._hang_up()
            raise
        self._reader.start()
        return self

    def close(self) -> None:
        """Close the connection now, whatever is under way."""
        with self._news:
            self._conversation.lost(None)
            self._news.notify_all()
        self._hang_up()
        if self._reader.is_alive() and threading.current_thread() is not self._reader:
            self._reader.join(2 * CLOSE_TIMEOUT_S)  # longer only while it connects; it then ends by itself

    def _pump(self) -> None:
        """Send what is to be sent, unless somebody is at it: then they will send this too."""
        with self._news:
            if self._pumping:
                return
            self._pumping = True
        while True:
            with self._news:
                pause = self._conversation.pause_s
                payload, socket = self._conversation.next_payload(), self._socket
                if payload is None or socket is None:
                    self._pumping = False
                    return
            with contextlib.suppress(ConnectionClosed):  # the reader sees it too, and knows why
                socket.send(payload)
            if pause:
                time.sleep(pause)

    def _run(self) -> None:
        """Read until the session is over, through as many connections as it takes."""
        try:
            while True:
                failure: FervorError | None = self._talk()
                while failure is not None:
                    if not self._wait(failure):
                        return
                    failure = self._dial()
                threading.Thread(target=self._pump, name="fervor-client-backlog", daemon=True).start()
        finally:
            with self._news:
                self._conversation.lost(Unreachable("the client stopped reading"))
                self._news.notify_all()
            self._hang_up()

    def _talk(self) -> FervorError:
        """Read until the connection is gone or the session over; why."""
        try:
            while self._conversation.linked:
                self._read_one(self._quiet_s())
        except ConnectionClosed as error:
            return closed(error, self._way.shown, unanswered=self.in_flight)
        finally:
            self._hang_up()
        return Unreachable(f"the session with {self._way.shown} is over")

    def _wait(self, failure: FervorError) -> bool:
        """Wait until it is time to connect again; whether it is worth it."""
        with self._news:
            plan = self._conversation.interrupted(failure)
            self._news.notify_all()
        if plan is None or plan.delay_s is None:
            return False
        self._tell([plan])
        with self._news:
            return not self._news.wait_for(lambda: self._conversation.over, plan.delay_s)

    def _dial(self) -> FervorError | None:
        """Connect, then start the session or resume it; why that failed, unless the service told the conversation."""
        until = time.monotonic() + self._way.timeout_s
        try:
            socket = self._way.open_sync()
            with self._news:
                self._socket = socket
                check_subprotocol(socket.subprotocol, self._way.shown)
                payload = self._conversation.start()
            socket.send(payload)
            while self._conversation.linking:
                self._read_one(max(until - time.monotonic(), 0.0), keep=False)
        except FervorError as error:
            failure = error
        except (OSError, EOFError, WebSocketException) as error:
            failure = refused(error, self._way.shown)
            failure.__cause__ = error
        else:
            return None
        self._hang_up()
        return failure

    def _hang_up(self) -> None:
        if self._socket is not None:
            self._socket.close()

    def _read_one(self, timeout: float | None, *, keep: bool = True) -> None:
        """Take in a message; where none comes in time, `keep` the connection alive or raise."""
        assert self._socket is not None, "only a connection is read"
        try:
            payload = self._socket.recv(timeout=timeout)
        except TimeoutError:
            if not keep:
                raise
            self._socket.send(self._conversation.ping())
            return
        with self._news:
            news = self._conversation.receive(payload)
            self._news.notify_all()
        self._tell(news)
