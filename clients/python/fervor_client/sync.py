"""The client for threads: `connect` and `Session`, the twins of those for asyncio."""

import logging
import ssl as tls
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self, Unpack

from fervor.errors import FervorError
from fervor.protocol.messages import Estimate, SessionCalibrated, Totals
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor_client.address import DEFAULT_URL
from fervor_client.answers import Key
from fervor_client.base import RETRY_FOR_S, WINDOW, OnError, OnReconnect, log_error, log_reconnect
from fervor_client.conversation import Conversation
from fervor_client.dialling import Way
from fervor_client.options import Held, Options, calibration, opening
from fervor_client.poses import Pose
from fervor_client.retrying import Retries
from fervor_client.standing import State
from fervor_client.sync_connection import Connected

logger = logging.getLogger("fervor_client")


class Session(Connected):
    """A live session: poses in, estimates out. `connect` makes it; any thread may use it.

    Every frame is answered by one estimate. `estimate` sends a pose and waits for its answer; `send` does not wait,
    the answers are read by `recv` or by iterating. Errors and cuts are as in the async `Session`; `on_error` and
    `on_reconnect` are called from the thread that reads, so they must not wait for the session.
    """

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
        with self._news:
            self._conversation.reset_body(body)
        self._pump()

    def end_body(self, body: str) -> None:
        """Say that a body is gone, so that the service frees what it keeps of it."""
        with self._news:
            self._conversation.end_body(body)
        self._pump()

    def calibrate(self, *, timeout: float | None = 30.0, **held: Unpack[Held]) -> SessionCalibrated:
        """Take the alignment of an unknown sensor from a held pose; another thread sends its frames.

        See the async `Session.calibrate`.
        """
        with self._news:
            number = self._conversation.calibrate(calibration(held))
            self._news.notify_all()  # whoever awaits one that this one replaces
        self._pump()
        with self._news:
            found = self._news.wait_for(lambda: self._conversation.take_calibration(number), timeout)
        if found is None:
            raise TimeoutError(f"no calibration within {timeout} s; is the pose being sent?")
        return found

    def end(self, *, timeout: float | None = 10.0) -> Totals:
        """Say that no more poses come, and wait until all are answered. See the async `Session.end`."""
        with self._news:
            if self._conversation.state is State.OPEN:
                self._conversation.end()
        self._pump()
        with self._news:
            if not self._news.wait_for(lambda: self._conversation.over, timeout):
                raise TimeoutError(f"the service did not end the session within {timeout} s")
            if self._conversation.totals is None:
                self._conversation.must_be_open()
            assert self._conversation.totals is not None
            return self._conversation.totals

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
        with self._news:
            self._news.wait_for(self._has_room)
            number = self._conversation.frame(
                pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=awaited
            )
        self._pump()
        return body, number


def connect(
    url: str = DEFAULT_URL,
    *,
    skeleton: str | SkeletonSpec = "c13",
    emotion: str | Mapping[str, float] | None = None,
    token: str | None = None,
    window: int = WINDOW,
    on_error: OnError = log_error,
    resume: bool = True,
    retry_for: float | None = RETRY_FOR_S,
    on_reconnect: OnReconnect = log_reconnect,
    ssl: tls.SSLContext | None = None,
    open_timeout: float = 10.0,
    **options: Unpack[Options],
) -> Session:
    """Open a session, to be used in a `with`. Arguments and errors are those of the async `connect`."""
    start = opening(skeleton, emotion, options, resume=resume)
    way = Way.to(url, token=token, ssl=ssl, timeout_s=open_timeout)
    retries = Retries(retry_for, now=time.monotonic) if resume else None
    conversation = Conversation(start, url=way.shown, retries=retries)
    return Session(way, conversation, window=window, on_error=on_error, on_reconnect=on_reconnect).start()
