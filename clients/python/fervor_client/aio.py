"""The client for asyncio: `connect` and `Session`. `fervor_client.sync` has the same names for threads."""

import asyncio
import logging
import ssl as tls
import time
from collections.abc import Generator, Mapping, Sequence
from types import TracebackType
from typing import Self, Unpack

from fervor.errors import FervorError
from fervor.protocol.messages import Estimate, SessionCalibrated, Totals
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor_client.address import DEFAULT_URL
from fervor_client.aio_connection import Connected
from fervor_client.answers import Key
from fervor_client.base import RETRY_FOR_S, WINDOW, OnError, OnReconnect, log_error, log_reconnect
from fervor_client.conversation import Conversation
from fervor_client.dialling import Way
from fervor_client.options import Held, Options, calibration, opening
from fervor_client.poses import Pose
from fervor_client.retrying import Retries
from fervor_client.standing import State

logger = logging.getLogger("fervor_client")


class Session(Connected):
    """A live session: poses in, estimates out. `connect` makes it.

    Every frame is answered by one estimate. `estimate` sends a pose and waits for its answer; `send` does not wait,
    the answers are read by `recv` or by `async for`. Poses may be sent and estimates read from several tasks.

    Errors. A frame that the service refuses harms nothing else: its `estimate` raises, and for frames that were sent
    by `send` the error goes to `on_error`. A cut is mended behind the scenes: frames are taken and answers awaited as
    if nothing had happened, once `window` frames are under way sending waits, and every frame is answered once. Where
    the session itself is lost, everything raises: `send` and `estimate` at once, `recv` and the iteration after the
    last estimate that came.
    """

    async def send(
        self,
        pose: Pose,
        *,
        body: str = "0",
        seq: int | None = None,
        t: float | None = None,
        emotion: str | Mapping[str, float] | None = None,
        mask: Sequence[bool] | None = None,
    ) -> int:
        """Send a pose; wait only while `window` frames are under way.

        Args:
            pose: [joint, 4] quaternions (landmark sensors: [joint, 3] positions) in the order of `joints`; None or NaN
                where a joint is untracked.
            body: whose pose it is, where several people are tracked.
            seq: the frame's number; one more than the body's last if None.
            t: seconds on the caller's clock; the monotonic clock's now if None. Don't mix the two.
            emotion: a new label or a probability per emotion; the old one holds if None.
            mask: [joint], false where untracked.

        Returns:
            The frame's seq, which its estimate will carry.

        Raises:
            FrameError: the pose can't be sent; the session goes on.
            FervorError: the session is lost or has ended.
        """
        return (await self._send(pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=False))[1]

    async def estimate(
        self,
        pose: Pose,
        *,
        body: str = "0",
        seq: int | None = None,
        t: float | None = None,
        emotion: str | Mapping[str, float] | None = None,
        mask: Sequence[bool] | None = None,
        timeout: float | None = 10.0,  # noqa: ASYNC109  # so that both twins have it
    ) -> Estimate:
        """Send a pose and wait for its estimate, `timeout` seconds at most. For the rest see `send`.

        Under delivery `latest` it may be the estimate of a newer frame of the same body.

        Raises:
            FrameError: the pose can't be sent or the service refused it; the session goes on.
            TimeoutError: no answer in time; it will be among those that `recv` gives.
            FervorError: the session is lost or has ended.
        """
        key: Key | None = None
        try:
            async with asyncio.timeout(timeout):
                key = await self._send(pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=True)
                async with self._news:
                    while (answer := self._conversation.take(key)) is None:
                        await self._news.wait()
                    return answer
        except TimeoutError:
            raise TimeoutError(f"no estimate for body {body!r} within {timeout} s") from None
        finally:
            if key is not None:
                self._conversation.give_up(key)

    async def recv(self) -> Estimate:
        """The next estimate of a frame that was sent by `send`.

        Raises:
            EOFError: the session has ended and all estimates are read.
            FervorError: the session is lost, and all estimates that came before are read.
        """
        async with self._news:
            while (estimate := self._conversation.next_estimate()) is None:
                if self._conversation.over:
                    raise EOFError("the session has ended and all its estimates are read")
                await self._news.wait()
            return estimate

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Estimate:
        try:
            return await self.recv()
        except EOFError:
            raise StopAsyncIteration from None

    async def reset_body(self, body: str = "0") -> None:
        """Forget what a body did so far; its next pose is a first one."""
        self._conversation.reset_body(body)
        await self._pump()

    async def end_body(self, body: str) -> None:
        """Say that a body is gone, so that the service frees what it keeps of it."""
        self._conversation.end_body(body)
        await self._pump()

    async def calibrate(self, *, timeout: float | None = 30.0, **held: Unpack[Held]) -> SessionCalibrated:  # noqa: ASYNC109
        """Take the alignment of an unknown sensor from a pose that a body holds; another task sends its frames.

        It is in force from then on. Keep the `skeleton` of the answer as JSON; `connect` takes it again.

        Raises:
            InputError: the pose was not held still, and nothing changed; or another calibration took its place.
            TimeoutError: not enough frames came in time.
            FervorError: the session is lost or has ended.
        """
        async with self._news:
            number = self._conversation.calibrate(calibration(held))
            self._news.notify_all()  # whoever awaits one that this one replaces
        await self._pump()
        try:
            async with asyncio.timeout(timeout), self._news:
                while (found := self._conversation.take_calibration(number)) is None:
                    await self._news.wait()
                return found
        except TimeoutError:
            raise TimeoutError(f"no calibration within {timeout} s; is the pose being sent?") from None

    async def end(self, *, timeout: float | None = 10.0) -> Totals:  # noqa: ASYNC109  # so that both twins have it
        """Say that no more poses come, and wait until all are answered. Estimates can still be read.

        Returns:
            What the service counted.

        Raises:
            TimeoutError: the service did not end the session in time.
            FervorError: the session is lost.
        """
        if self._conversation.state is State.OPEN:
            self._conversation.end()
            await self._pump()
        try:
            async with asyncio.timeout(timeout), self._news:
                await self._news.wait_for(lambda: self._conversation.over)
        except TimeoutError:
            raise TimeoutError(f"the service did not end the session within {timeout} s") from None
        if self._conversation.totals is None:
            self._conversation.must_be_open()
        assert self._conversation.totals is not None
        return self._conversation.totals

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the session if all went well, and close the connection in any case; raises nothing of its own."""
        try:
            if kind is None and not self._conversation.over:
                await self.end()
        except (FervorError, TimeoutError) as failure:
            logger.debug("the session did not end as it should: %s", failure)
        finally:
            await self.close()

    async def _send(
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
        if not self._has_room():
            async with self._news:
                await self._news.wait_for(self._has_room)
        number = self._conversation.frame(pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=awaited)
        await self._pump()
        return body, number


class connect:  # noqa: N801  # called like a function, as in websockets
    """Open a session: `async with connect(url) as session`, or `session = await connect(url)` and `session.close()`.

    Args:
        url: where the service is, like `ws://robot.local:8080`; the path `/v1/stream` is added where there is none.
        skeleton: what poses are sent in: a name from the service's `/v1/skeletons`, or one of your own.
        emotion: the label that holds until a frame brings one.
        token: for a service that wants one.
        window: most frames under way; then sending waits.
        on_error: called with recoverable errors that nobody awaits, by default to log them; it must not wait.
        resume: go on by itself after a cut, as if there had been none; else the first cut ends the session.
        retry_for: seconds to try for, after which the session is lost; None: for ever.
        on_reconnect: called when the connection is lost, when an attempt fails, and when the stream goes on, by default
            to log it; it must not wait.
        ssl: TLS settings for `wss://`; the system's if None.
        open_timeout: seconds for connecting and starting, and for each attempt to reconnect.
        options: see `Options`.

    Raises:
        InputError: a wrong address or option.
        AuthError: no token, or a wrong one.
        Overloaded: the service takes no session now; `retry_after` says when to try again.
        Unreachable: no service answers there.
    """

    def __init__(
        self,
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
    ) -> None:
        start = opening(skeleton, emotion, options, resume=resume)
        way = Way.to(url, token=token, ssl=ssl, timeout_s=open_timeout)
        retries = Retries(retry_for, now=time.monotonic) if resume else None
        conversation = Conversation(start, url=way.shown, retries=retries)
        self._session = Session(way, conversation, window=window, on_error=on_error, on_reconnect=on_reconnect)

    def __await__(self) -> Generator[object, None, Session]:
        return self._session.start().__await__()

    async def __aenter__(self) -> Session:
        return await self._session.start()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._session.__aexit__(kind, error, trace)
