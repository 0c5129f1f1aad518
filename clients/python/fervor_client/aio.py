"""The client for asyncio: `connect` and `Session`. `fervor_client.sync` has the same names for threads."""

import asyncio
import logging
import ssl as tls
from collections.abc import Generator, Mapping, Sequence
from types import TracebackType
from typing import Any, Self, Unpack

from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed, WebSocketException
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
    """A live session: poses in, estimates out. `connect` makes it.

    Every frame is answered by one estimate. `estimate` sends a pose and waits for its answer; `send` does not wait,
    the answers are read by `recv` or by `async for`. Poses may be sent and estimates read from several tasks.

    Errors. A frame that the service refuses harms nothing else: its `estimate` raises, and for frames that were sent
    by `send` the error goes to `on_error`. Where the session itself is lost, everything raises: `send` and `estimate`
    at once, `recv` and the iteration after the last estimate that came.
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
        self._news = asyncio.Condition()
        self._reader: asyncio.Task[None] | None = None

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
        await self._write(self._conversation.reset_body(body))

    async def end_body(self, body: str) -> None:
        """Say that a body is gone, so that the service frees what it keeps of it."""
        await self._write(self._conversation.end_body(body))

    async def calibrate(self, *, timeout: float | None = 30.0, **held: Unpack[Held]) -> SessionCalibrated:  # noqa: ASYNC109
        """Take the alignment of an unknown sensor from a pose that a body holds; another task sends its frames.

        It is in force from then on. Keep the `skeleton` of the answer as JSON; `connect` takes it again.

        Raises:
            InputError: the pose was not held still; nothing changed.
            TimeoutError: not enough frames came in time.
            FervorError: the session is lost or has ended.
        """
        await self._write(self._conversation.calibrate(calibration(held)))
        try:
            async with asyncio.timeout(timeout), self._news:
                while (found := self._conversation.take_calibration()) is None:
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
            await self._write(self._conversation.end())
        try:
            async with asyncio.timeout(timeout), self._news:
                await self._news.wait_for(lambda: self._conversation.over)
        except TimeoutError:
            raise TimeoutError(f"the service did not end the session within {timeout} s") from None
        if self._conversation.totals is None:
            self._conversation.must_be_open()
        assert self._conversation.totals is not None
        return self._conversation.totals

    async def close(self) -> None:
        """Close the connection now, whatever is under way."""
        self._conversation.lost(None)
        await self._socket.close()
        if self._reader is not None:
            await asyncio.wait([self._reader])

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

    async def start(self) -> None:
        """Open the conversation. `connect` does it.

        Raises:
            FervorError: the service refused.
        """
        self._reader = asyncio.create_task(self._read(), name="fervor-client")
        await self._write(self._conversation.start())
        async with self._news:
            await self._news.wait_for(lambda: self._conversation.state is not State.STARTING)
        self._conversation.must_be_open()

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
        number, payload = self._conversation.frame(
            pose, body=body, seq=seq, t=t, emotion=emotion, mask=mask, awaited=awaited
        )
        await self._write(payload)
        return body, number

    async def _write(self, payload: str | bytes) -> None:
        try:
            await self._socket.send(payload)
        except ConnectionClosed:
            if self._reader is not None:
                await asyncio.wait([self._reader])  # it knows why
            self._conversation.must_be_open()

    async def _read(self) -> None:
        """Take in what comes until the connection ends; keep it alive while nothing does."""
        failure: FervorError | None = Unreachable("the client stopped reading")
        try:
            while not self._conversation.over:
                await self._read_one()
            failure = None
        except ConnectionClosed as error:
            failure = closed(error, self._conversation.url, unanswered=self.in_flight)
        finally:
            self._conversation.lost(failure)
            async with self._news:
                self._news.notify_all()
        await self._socket.close()

    async def _read_one(self) -> None:
        try:
            async with asyncio.timeout(self._quiet_s()):
                payload = await self._socket.recv()
        except TimeoutError:
            await self._socket.send(self._conversation.ping())
            return
        async with self._news:
            errors = self._conversation.receive(payload)
            self._news.notify_all()
        for error in errors:
            self._tell(error)


class connect:  # noqa: N801  # called like a function, as in websockets
    """Open a session: `async with connect(url) as session`, or `session = await connect(url)` and `session.close()`.

    Args:
        url: where the service is, like `ws://robot.local:8080`; the path `/v1/stream` is added where there is none.
        skeleton: what poses are sent in: a name from the service's `/v1/skeletons`, or one of your own.
        emotion: the label that holds until a frame brings one.
        token: for a service that wants one.
        window: most frames under way; then sending waits.
        on_error: called with recoverable errors that nobody awaits, by default to log them; it must not wait.
        ssl: TLS settings for `wss://`; the system's if None.
        open_timeout: seconds for connecting and starting.
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
        ssl: tls.SSLContext | None = None,
        open_timeout: float = 10.0,
        **options: Unpack[Options],
    ) -> None:
        self._start = opening(skeleton, emotion, options)
        self._url = stream_url(url)
        self._shown = without_secrets(self._url)
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._window = window
        self._on_error = on_error
        self._tls: dict[str, Any] = {"ssl": ssl} if ssl else {}
        self._open_timeout = open_timeout
        self._session: Session | None = None

    def __await__(self) -> Generator[object, None, Session]:
        return self._open().__await__()

    async def __aenter__(self) -> Session:
        self._session = await self._open()
        return self._session

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._session is not None, "__aenter__ came first"
        await self._session.__aexit__(kind, error, trace)

    async def _open(self) -> Session:
        try:
            async with asyncio.timeout(self._open_timeout):
                socket = await open_socket(
                    self._url,
                    subprotocols=[Subprotocol(SUBPROTOCOL)],
                    compression=None,
                    additional_headers=self._headers,
                    open_timeout=None,
                    close_timeout=CLOSE_TIMEOUT_S,
                    **self._tls,
                )
                return await self._begin(socket)
        except (OSError, EOFError, WebSocketException) as error:
            raise refused(error, self._shown) from error

    async def _begin(self, socket: ClientConnection) -> Session:
        conversation = Conversation(self._start, url=self._shown)
        session = Session(socket, conversation, window=self._window, on_error=self._on_error)
        try:
            check_subprotocol(socket.subprotocol, self._shown)
            await session.start()
        except BaseException:
            await session.close()
            raise
        return session
