"""The client for threads: `connect` and `Session`, the twins of those for asyncio."""

import contextlib
import logging
import ssl as tls
import threading
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self, Unpack

from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import ClientConnection
from websockets.sync.client import connect as open_socket
from websockets.typing import Subprotocol

from fervor.errors import FervorError
from fervor.protocol.messages import Estimate, SessionCalibrated, Totals
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor_client.address import DEFAULT_URL, stream_url, without_secrets
from fervor_client.base import CLOSE_TIMEOUT_S, WINDOW, BaseSession, OnError, log_error
from fervor_client.conversation import Conversation, Key, State
from fervor_client.failures import SUBPROTOCOL, Unreachable, check_subprotocol, closed, refused
from fervor_client.options import Held, Options, calibration, opening
from fervor_client.poses import Pose

logger = logging.getLogger("fervor_client")


class Session(BaseSession):
    """A live session: poses in, estimates out. `connect` makes it; any thread may use it.

    Every frame is answered by one estimate. `estimate` sends a pose and waits for its answer; `send` does not wait,
    the answers are read by `recv` or by iterating. Errors are as in the async `Session`; `on_error` is called from the
    thread that reads, so it must not wait for the session.
    """

    def __init__(
        self,
        socket: ClientConnection,
        conversation: Conversation,
        *,
        window: int = WINDOW,
        on_error: OnError = log_error,
    ) -> None:
        super().__init__(conversation, window=window, on_error=on_error)
        self._socket = socket
        self._sending = threading.Lock()  # payloads leave in the order in which they are made
        self._news = threading.Condition()  # guards the conversation
        self._reader = threading.Thread(target=self._read, name="fervor-client", daemon=True)

    def send(
        self,
        pose: Pose,
        *,
        body: str = "0",
        seq: int | None = None,
        t: float | None = None,
        emotion: str | Mapping[str, float] | None = None,
        mask: Sequence[bool] | None = None,
    ) -> int:
        """Send a pose; wait only while `window` frames are under way. See the async `Session.send`."""
        return self._send(pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=False)[1]

    def estimate(
        self,
        pose: Pose,
        *,
        body: str = "0",
        seq: int | None = None,
        t: float | None = None,
        emotion: str | Mapping[str, float] | None = None,
        mask: Sequence[bool] | None = None,
        timeout: float | None = 10.0,
    ) -> Estimate:
        """Send a pose and wait for its estimate, `timeout` seconds at most. See the async `Session.estimate`."""
        key = self._send(pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=True)
        with self._news:
            try:
                answer = self._news.wait_for(lambda: self._conversation.take(key), timeout)
            finally:
                self._conversation.give_up(key)
        if answer is None:
            raise TimeoutError(f"no estimate for body {body!r} within {timeout} s")
        return answer

    def recv(self, timeout: float | None = None) -> Estimate:
        """The next estimate of a frame that was sent by `send`.

        Raises:
            TimeoutError: none came within `timeout` seconds.
            EOFError: the session has ended and all estimates are read.
            FervorError: the session is lost, and all estimates that came before are read.
        """
        with self._news:
            return self._next(timeout)

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Estimate:
        try:
            return self.recv()
        except EOFError:
            raise StopIteration from None

    def reset_body(self, body: str = "0") -> None:
        """Forget what a body did so far; its next pose is a first one."""
        with self._sending:
            with self._news:
                payload = self._conversation.reset_body(body)
            self._write(payload)

    def end_body(self, body: str) -> None:
        """Say that a body is gone, so that the service frees what it keeps of it."""
        with self._sending:
            with self._news:
                payload = self._conversation.end_body(body)
            self._write(payload)

    def calibrate(self, *, timeout: float | None = 30.0, **held: Unpack[Held]) -> SessionCalibrated:
        """Take the alignment of an unknown sensor from a held pose; another thread sends its frames.

        See the async `Session.calibrate`.
        """
        with self._sending:
            with self._news:
                payload = self._conversation.calibrate(calibration(held))
            self._write(payload)
        with self._news:
            found = self._news.wait_for(self._conversation.take_calibration, timeout)
        if found is None:
            raise TimeoutError(f"no calibration within {timeout} s; is the pose being sent?")
        return found

    def end(self, *, timeout: float | None = 10.0) -> Totals:
        """Say that no more poses come, and wait until all are answered. See the async `Session.end`."""
        with self._sending:
            with self._news:
                payload = self._conversation.end() if self._conversation.state is State.OPEN else None
            if payload is not None:
                self._write(payload)
        with self._news:
            if not self._news.wait_for(lambda: self._conversation.over, timeout):
                raise TimeoutError(f"the service did not end the session within {timeout} s")
            if self._conversation.totals is None:
                self._conversation.must_be_open()
            assert self._conversation.totals is not None
            return self._conversation.totals

    def close(self) -> None:
        """Close the connection now, whatever is under way."""
        with self._news:
            self._conversation.lost(None)
            self._news.notify_all()
        self._socket.close()
        if self._reader.is_alive() and threading.current_thread() is not self._reader:
            self._reader.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the session if all went well, and close the connection in any case; raises nothing of its own."""
        try:
            if kind is None and not self._conversation.over:
                self.end()
        except (FervorError, TimeoutError) as failure:
            logger.debug("the session did not end as it should: %s", failure)
        finally:
            self.close()

    def start(self, timeout: float | None) -> None:
        """Open the conversation. `connect` does it.

        Raises:
            TimeoutError: the service did not answer in time.
            FervorError: the service refused.
        """
        self._reader.start()
        self._write(self._conversation.start())
        with self._news:
            if not self._news.wait_for(lambda: self._conversation.state is not State.STARTING, timeout):
                raise TimeoutError
            self._conversation.must_be_open()

    def _next(self, timeout: float | None) -> Estimate:
        def ready() -> Estimate | bool | None:
            return self._conversation.next_estimate() or self._conversation.over

        estimate = self._news.wait_for(ready, timeout)
        if isinstance(estimate, Estimate):
            return estimate
        if estimate:
            raise EOFError("the session has ended and all its estimates are read")
        raise TimeoutError(f"no estimate within {timeout} s")

    def _send(
        self,
        pose: Pose,
        *,
        body: str,
        seq: int | None,
        t: float | None,
        emotion: str | Mapping[str, float] | None,
        mask: Sequence[bool] | None,
        awaited: bool,
    ) -> Key:
        with self._sending:
            with self._news:
                self._news.wait_for(self._has_room)
                number, payload = self._conversation.frame(
                    pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=awaited
                )
            self._write(payload)
        return body, number

    def _write(self, payload: str | bytes) -> None:
        try:
            self._socket.send(payload)
        except ConnectionClosed:
            if threading.current_thread() is not self._reader:
                self._reader.join()  # it knows why
            self._conversation.must_be_open()

    def _read(self) -> None:
        """Take in what comes until the connection ends; keep it alive while nothing does."""
        failure: FervorError | None = Unreachable("the client stopped reading")
        try:
            while not self._conversation.over:
                self._read_one()
            failure = None
        except ConnectionClosed as error:
            failure = closed(error, self._conversation.url, unanswered=self.in_flight)
        finally:
            with self._news:
                self._conversation.lost(failure)
                self._news.notify_all()
        self._socket.close()

    def _read_one(self) -> None:
        try:
            payload = self._socket.recv(timeout=self._quiet_s())
        except TimeoutError:
            self._socket.send(self._conversation.ping())
            return
        with self._news:
            errors = self._conversation.receive(payload)
            self._news.notify_all()
        for error in errors:
            self._tell(error)


def connect(
    url: str = DEFAULT_URL,
    *,
    skeleton: str | SkeletonSpec = "c13",
    emotion: str | Mapping[str, float] | None = None,
    token: str | None = None,
    window: int = WINDOW,
    on_error: OnError = log_error,
    ssl: tls.SSLContext | None = None,
    open_timeout: float = 10.0,
    **options: Unpack[Options],
) -> Session:
    """Open a session, to be used in a `with`. Arguments and errors are those of the async `connect`."""
    start, url = opening(skeleton, emotion, options), stream_url(url)
    shown = without_secrets(url)
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    with contextlib.ExitStack() as undo:
        try:
            socket = undo.enter_context(
                open_socket(
                    url,
                    subprotocols=[Subprotocol(SUBPROTOCOL)],
                    compression=None,
                    additional_headers=headers,
                    open_timeout=open_timeout,
                    close_timeout=CLOSE_TIMEOUT_S,
                    ssl=ssl,
                )
            )
            check_subprotocol(socket.subprotocol, shown)
            session = Session(socket, Conversation(start, url=shown), window=window, on_error=on_error)
            session.start(open_timeout)
        except (OSError, EOFError, WebSocketException) as error:
            raise refused(error, shown) from error
        undo.pop_all()
    return session
