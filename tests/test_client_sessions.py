"""Both twins, `fervor_client.connect` and `fervor_client.sync.connect`, against services that follow a script.

Every test runs for both: the async session is driven from here through an event loop in a thread. `Wire` is the
service's end: a real WebSocket that speaks the protocol through the codec, and misbehaves where the script says so.
"""

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any, Self

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

import fervor_client
from fervor.errors import (
    AuthError,
    FervorError,
    FrameError,
    InputError,
    Overloaded,
    ProtocolError,
    RateExceeded,
    RequestError,
)
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import (
    ClientMessage,
    Error,
    Estimate,
    Frame,
    Limits,
    ModelInfo,
    Ping,
    Pong,
    ServerMessage,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor.skeletons.rig import JOINTS

CODEC = CODECS["fervor.v1.json"]
POSE = np.tile([0.0, 0.0, 0.0, 1.0], (13, 1))


class Wire:
    """The service's end of one connection."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.frames = 0

    def recv(self) -> ClientMessage:
        return CODEC.decode_client(self.connection.recv())

    def send(self, *messages: ServerMessage) -> None:
        for message in messages:
            self.connection.send(CODEC.encode(message))

    def open(self, **limits: float) -> SessionStart:
        start = self.recv()
        assert isinstance(start, SessionStart)
        self.send(started(**limits))
        return start

    def frames_of(self, count: int) -> list[Frame]:
        frames = [self.recv() for _ in range(count)]
        assert all(isinstance(frame, Frame) for frame in frames)
        return frames  # type: ignore[return-value]

    def end(self) -> None:
        assert isinstance(self.recv(), SessionEnd)
        self.send(SessionEnded(reason="ended by the client", totals=Totals(frames=self.frames)))

    def cut(self) -> None:
        """The network goes: no close frame, no goodbye."""
        self.connection.socket.shutdown(socket.SHUT_RDWR)


def started(**limits: float) -> SessionStarted:
    model = ModelInfo(
        name="m", version="1", purpose="demo", sha256="0", rate_hz=30.0, emotions=("joy",), thresholds={"joy": 0.5}
    )
    return SessionStarted(session_id="s", model=model, limits=Limits(**limits), joints=JOINTS, fingerprint="f")  # type: ignore[arg-type]


def answer(frame: Frame) -> Estimate:
    assert frame.t is not None
    emotion = frame.emotion if isinstance(frame.emotion, str) else "unknown"
    return Estimate(
        body=frame.body,
        seq=frame.seq,
        t=frame.t,
        intensity=frame.seq / 100,
        level="weak",
        emotion=emotion,
        status="ok",
    )


def echo(wire: Wire) -> None:
    """A service that behaves."""
    wire.open()
    while isinstance(message := wire.recv(), Frame):
        wire.frames += 1
        wire.send(answer(message))
    assert isinstance(message, SessionEnd)
    wire.send(SessionEnded(reason="ended by the client", totals=Totals(frames=wire.frames)))


@contextlib.contextmanager
def service(script: Callable[[Wire], None], **options: Any) -> Iterator[str]:
    """A service whose every connection follows `script`; yields its address. An assertion in it fails the test."""
    failures: list[BaseException] = []

    def handle(connection: ServerConnection) -> None:
        try:
            script(Wire(connection))
        except ConnectionClosed:
            pass
        except BaseException as error:  # noqa: BLE001  # told below, in the test's thread
            failures.append(error)

    options = {"subprotocols": [CODEC.subprotocol], "compression": None, **options}
    with serve(handle, "127.0.0.1", 0, **options) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}"
        finally:
            server.shutdown()
            thread.join()
    if failures:
        raise failures[0]


class AsyncAsSync:
    """The async session, called from a thread that is not its loop's."""

    def __init__(self, loop: asyncio.AbstractEventLoop, session: fervor_client.Session) -> None:
        self._loop = loop
        self._session = session

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._session, name)
        return (lambda *args, **kwargs: self._run(value(*args, **kwargs))) if callable(value) else value

    def __iter__(self) -> Iterator[Estimate]:
        with contextlib.suppress(StopAsyncIteration):
            while True:
                yield self._run(self._session.__anext__())

    def __enter__(self) -> Self:
        self._run(self._session.__aenter__())
        return self

    def __exit__(self, *error: object) -> None:
        self._run(self._session.__aexit__(*error))

    def _run(self, coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result()


@pytest.fixture(params=["async", "sync"], name="connect")
def twin(request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """`connect` of one of the twins, with the names of the sync one."""
    if request.param == "sync":
        yield fervor_client.sync.connect
        return
    with asyncio.Runner() as runner:
        loop = runner.get_loop()
        thread = threading.Thread(target=loop.run_forever)
        thread.start()

        def open_session(*args: Any, **kwargs: Any) -> AsyncAsSync:
            async def wait() -> fervor_client.Session:
                return await fervor_client.connect(*args, **kwargs)

            return AsyncAsSync(loop, asyncio.run_coroutine_threadsafe(wait(), loop).result())

        yield open_session
        loop.call_soon_threadsafe(loop.stop)
        thread.join()


# --- a session that goes well ----------------------------------------------------------------------------------------


def test_estimates_answer_the_frames_they_belong_to(connect: Callable[..., Any]) -> None:
    with service(echo) as url, connect(url, emotion="joy") as session:
        assert (session.model.name, session.joints, session.started.session_id) == ("m", JOINTS, "s")
        assert [session.estimate(POSE, t=n / 30).intensity for n in range(3)] == [0.0, 0.01, 0.02]
        assert session.in_flight == 0


def test_sent_frames_are_read_in_a_loop_that_ends_with_the_session(connect: Callable[..., Any]) -> None:
    with service(echo) as url, connect(url) as session:
        seqs = [session.send(POSE, t=n / 30, emotion="joy" if n == 2 else None) for n in range(5)]
        assert session.end() == Totals(frames=5)
        estimates = list(session)
        assert [estimate.seq for estimate in estimates] == seqs == [0, 1, 2, 3, 4]
        assert [estimate.t for estimate in estimates] == [n / 30 for n in range(5)]
        assert estimates[2].emotion == "joy"
        with pytest.raises(EOFError, match="all its estimates are read"):
            session.recv()
        assert session.end() == Totals(frames=5)


def test_answers_out_of_order_find_their_frames(connect: Callable[..., Any]) -> None:
    def backwards(wire: Wire) -> None:
        wire.open()
        wire.send(*(answer(frame) for frame in reversed(wire.frames_of(4))))
        wire.end()

    with service(backwards) as url, connect(url) as session:
        for _ in range(3):
            session.send(POSE)
        assert session.estimate(POSE).seq == 3
        session.end()
        assert [estimate.seq for estimate in session] == [2, 1, 0]


def test_two_bodies_have_numbers_of_their_own(connect: Callable[..., Any]) -> None:
    with service(echo) as url, connect(url) as session:
        told = [session.estimate(POSE, body=body) for body in ("ann", "bob", "ann")]
        assert [(estimate.body, estimate.seq) for estimate in told] == [("ann", 0), ("bob", 0), ("ann", 1)]


def test_what_was_asked_for_is_in_the_start(connect: Callable[..., Any]) -> None:
    asked: list[SessionStart] = []

    def script(wire: Wire) -> None:
        asked.append(wire.open())
        wire.end()

    with service(script) as url:
        options = {"axes": "global", "joints": ["a", "b"], "delivery": "latest", "memory": "stateful"}
        with connect(url, skeleton="kinect_v2", emotion={"joy": 0.5}, **options):
            pass
    assert asked == [
        SessionStart(
            skeleton="kinect_v2",
            emotion={"joy": 0.5},
            axes="global",
            joints=("a", "b"),
            delivery="latest",
            memory="stateful",
            checkpoint_s=1.0,
        )
    ]


def test_bodies_are_reset_and_ended(connect: Callable[..., Any]) -> None:
    heard: list[str] = []

    def script(wire: Wire) -> None:
        wire.open()
        heard.extend(f"{message.type} {message.body}" for message in (wire.recv(), wire.recv()))  # type: ignore[union-attr]
        wire.end()

    with service(script) as url, connect(url) as session:
        session.reset_body()
        session.end_body("ann")
    assert heard == ["body.reset 0", "body.end ann"]


def test_leaving_waits_for_the_answers_under_way(connect: Callable[..., Any]) -> None:
    with service(echo) as url:
        with connect(url) as session:
            for _ in range(20):
                session.send(POSE)
        assert len(list(session)) == 20


def test_time_is_the_monotonic_clock_where_none_is_given(connect: Callable[..., Any]) -> None:
    with service(echo) as url, connect(url) as session:
        first, second = session.estimate(POSE), session.estimate(POSE)
        assert first.t < second.t


def test_a_client_with_nothing_to_say_stays_connected(connect: Callable[..., Any]) -> None:
    pinged = threading.Event()

    def script(wire: Wire) -> None:
        wire.open(idle_timeout_s=0.03)
        for _ in range(3):
            assert isinstance(wire.recv(), Ping)
            wire.send(Pong())
        pinged.set()
        while isinstance(message := wire.recv(), Ping):
            wire.send(Pong())
        assert isinstance(message, SessionEnd)
        wire.send(SessionEnded(reason="bye", totals=Totals()))

    with service(script) as url, connect(url):
        assert pinged.wait(10)


def test_sending_waits_while_the_window_is_full(connect: Callable[..., Any]) -> None:
    full, go = threading.Event(), threading.Event()

    def script(wire: Wire) -> None:
        wire.open()
        frames = wire.frames_of(3)
        full.set()
        with pytest.raises(TimeoutError):
            wire.connection.recv(timeout=0.05)
        assert go.wait(10)
        wire.send(answer(frames[0]))
        wire.frames_of(1)
        wire.end()

    with service(script) as url, connect(url, window=3) as session:
        sender = threading.Thread(target=lambda: [session.send(POSE) for _ in range(4)])
        sender.start()
        assert full.wait(10)
        assert session.in_flight == 3
        go.set()
        sender.join(10)
        assert session.in_flight == 3


# --- errors that the session survives --------------------------------------------------------------------------------


def refuse_odd(wire: Wire) -> None:
    wire.open()
    while isinstance(message := wire.recv(), Frame):
        refusal = Error(code="bad_frame", message=f"frame {message.seq} is odd", fatal=False, body="0", seq=message.seq)
        wire.send(refusal if message.seq % 2 else answer(message))
    wire.send(SessionEnded(reason="bye", totals=Totals()))


def test_a_refused_frame_raises_at_its_place_and_the_session_goes_on(connect: Callable[..., Any]) -> None:
    with service(refuse_odd) as url, connect(url) as session:
        assert session.estimate(POSE).seq == 0
        with pytest.raises(FrameError, match="frame 1 is odd") as caught:
            session.estimate(POSE)
        assert (caught.value.body, caught.value.seq) == ("0", 1)
        assert session.estimate(POSE).seq == 2


def test_a_refused_frame_that_nobody_awaits_goes_to_on_error(connect: Callable[..., Any]) -> None:
    errors: list[FervorError] = []
    with service(refuse_odd) as url, connect(url, on_error=errors.append) as session:
        for _ in range(4):
            session.send(POSE)
        session.end()
        assert [estimate.seq for estimate in session] == [0, 2]
    assert [(type(error), error.message) for error in errors] == [
        (FrameError, "frame 1 is odd"),
        (FrameError, "frame 3 is odd"),
    ]


def test_an_error_is_logged_where_nobody_listens(connect: Callable[..., Any], caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "fervor_client"), service(refuse_odd) as url, connect(url) as session:
        session.send(POSE)
        session.send(POSE)
        session.end()
    assert [record.getMessage() for record in caplog.records] == ["frame 1 is odd"]


def test_a_listener_that_fails_does_not_end_the_session(
    connect: Callable[..., Any], caplog: pytest.LogCaptureFixture
) -> None:
    def fail(error: FervorError) -> None:
        raise RuntimeError("the listener's own fault")

    with caplog.at_level(logging.ERROR), service(refuse_odd) as url, connect(url, on_error=fail) as session:
        session.send(POSE)
        session.send(POSE)
        assert session.estimate(POSE).seq == 2
    assert "on_error failed for: frame 1 is odd" in caplog.text


def test_a_pose_that_cannot_be_sent_never_leaves(connect: Callable[..., Any]) -> None:
    with service(echo) as url, connect(url) as session:
        with pytest.raises(FrameError, match=r"frame 0 of body '0': the pose has the shape \[12, 4\]"):
            session.send(POSE[:12])
        with pytest.raises(FrameError, match="expected"):
            session.estimate("nonsense")
        assert session.estimate(POSE).seq == 0


def test_an_answer_that_does_not_come_in_time_is_told_and_can_still_be_read(connect: Callable[..., Any]) -> None:
    go = threading.Event()

    def script(wire: Wire) -> None:
        wire.open()
        (frame,) = wire.frames_of(1)
        assert go.wait(10)
        wire.send(answer(frame))
        wire.end()

    with service(script) as url, connect(url) as session:
        with pytest.raises(TimeoutError, match=r"no estimate for body '0' within 0\.01 s"):
            session.estimate(POSE, timeout=0.01)
        go.set()
        assert session.recv().seq == 0


# --- errors that end the session -------------------------------------------------------------------------------------


def test_a_service_that_goes_away_mid_stream_is_a_clear_error(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.open()
        wire.send(answer(wire.frames_of(3)[0]))
        wire.cut()

    with service(script) as url, connect(url, resume=False) as session:
        for _ in range(3):
            session.send(POSE)
        assert session.recv().seq == 0
        for call in (session.recv, session.end, lambda: session.send(POSE), lambda: session.estimate(POSE)):
            with pytest.raises(fervor_client.Unreachable, match=r"closed the connection \(without a word\); 2 frames"):
                call()


def test_a_restart_is_told_with_its_code(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.open()
        wire.frames_of(1)
        wire.connection.close(1012, "restart")

    with (
        service(script) as url,
        connect(url, resume=False) as session,
        pytest.raises(fervor_client.Unreachable, match=r"code 1012, restart\); 1 frame has no answer"),
    ):
        session.estimate(POSE)


def test_a_fatal_error_is_raised_everywhere_after_what_came_before(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.open()
        wire.send(answer(wire.frames_of(2)[0]), Error(code="rate_exceeded", message="too fast", fatal=True))
        wire.connection.close(4429, "rate_exceeded")

    with service(script) as url, connect(url) as session:
        session.send(POSE)
        with pytest.raises(RateExceeded, match="too fast"):
            session.estimate(POSE)
        assert session.recv().seq == 0
        for call in (session.recv, session.end, lambda: session.send(POSE)):
            with pytest.raises(RateExceeded, match="too fast"):
                call()


def test_leaving_a_session_that_is_lost_raises_nothing_of_its_own(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.open()
        wire.frames_of(1)

    with service(script) as url, connect(url, resume=False) as session:
        session.send(POSE)


def test_a_caller_s_own_exception_passes_through(connect: Callable[..., Any]) -> None:
    def fail() -> None:
        with connect(url) as session:
            session.send(POSE)
            raise ZeroDivisionError

    with service(echo) as url, pytest.raises(ZeroDivisionError):
        fail()


def test_a_closed_session_takes_no_more(connect: Callable[..., Any]) -> None:
    with service(echo) as url:
        session = connect(url)
        session.close()
        session.close()
        assert list(session) == []
        for call in (lambda: session.send(POSE), lambda: session.estimate(POSE), session.end):
            with pytest.raises(fervor_client.Unreachable, match="has ended; connect again"):
                call()


def test_a_service_that_never_ends_the_session_is_not_waited_for_for_ever(connect: Callable[..., Any]) -> None:
    over = threading.Event()

    def script(wire: Wire) -> None:
        wire.open()
        assert isinstance(wire.recv(), SessionEnd)
        assert over.wait(10)

    with service(script) as url, connect(url) as session:
        with pytest.raises(TimeoutError, match=r"did not end the session within 0\.01 s"):
            session.end(timeout=0.01)
        over.set()


def test_nonsense_from_the_service_ends_the_session_with_a_sentence(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.open()
        wire.frames_of(1)
        wire.connection.send("<html>")
        wire.connection.recv()

    with service(script) as url, connect(url) as session, pytest.raises(ProtocolError, match="can't read"):
        session.estimate(POSE)


# --- sessions that never begin ---------------------------------------------------------------------------------------


def test_nobody_at_the_address(connect: Callable[..., Any]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(fervor_client.Unreachable, match=f"no service answers at ws://127.0.0.1:{port}/v1/stream"):
        connect(f"ws://127.0.0.1:{port}")


def test_a_wrong_address(connect: Callable[..., Any]) -> None:
    with pytest.raises(InputError, match="is not the address of a stream"):
        connect("http://robot:8080")


def test_a_host_that_does_not_exist(connect: Callable[..., Any]) -> None:
    with pytest.raises(fervor_client.Unreachable, match=r"no service answers at ws://nowhere\.invalid:1/v1/stream"):
        connect("ws://nowhere.invalid:1")


@pytest.mark.parametrize(
    ("status", "headers", "kind", "sentence"),
    [
        (503, {"Retry-After": "3"}, Overloaded, "The house is full; try again after 3 s"),
        (401, {}, AuthError, "The house is full"),
        (400, {}, RequestError, "The house is full"),
        (404, {}, InputError, "there is no stream at"),
    ],
)
def test_a_refused_handshake_is_one_sentence(
    connect: Callable[..., Any], status: int, headers: dict[str, str], kind: type[FervorError], sentence: str
) -> None:
    def refuse(connection: ServerConnection, _request: Any) -> Any:
        response = connection.respond(HTTPStatus(status), '{"title": "No", "detail": "The house is full."}')
        response.headers.update(headers)
        return response

    with service(echo, process_request=refuse) as url, pytest.raises(kind, match=sentence) as caught:
        connect(url)
    assert caught.value.retry_after == (3.0 if status == 503 else None)


def test_a_token_is_shown(connect: Callable[..., Any]) -> None:
    shown: list[str] = []

    def look(_connection: ServerConnection, request: Any) -> None:
        shown.append(request.headers["Authorization"])

    with service(echo, process_request=look) as url, connect(url, token="secret"):
        pass
    assert shown == ["Bearer secret"]


def test_a_refused_start_is_raised_from_connect(connect: Callable[..., Any]) -> None:
    def script(wire: Wire) -> None:
        wire.recv()
        wire.send(Error(code="bad_message", message="skeleton 'octopus' is not known", fatal=True))
        wire.connection.close(4400, "bad_message")

    with service(script) as url, pytest.raises(ProtocolError, match="skeleton 'octopus' is not known"):
        connect(url, skeleton="octopus")


def test_a_service_that_closes_before_the_start_is_told(connect: Callable[..., Any]) -> None:
    with (
        service(lambda wire: wire.connection.close(1013, "full")) as url,
        pytest.raises(Overloaded, match=r"code 1013, full"),
    ):
        connect(url)


def test_a_service_that_says_nothing_is_not_waited_for_for_ever(connect: Callable[..., Any]) -> None:
    over = threading.Event()
    with service(lambda wire: over.wait(10)) as url:
        with pytest.raises(fervor_client.Unreachable, match="in time"):
            connect(url, open_timeout=0.3)
        over.set()


def test_somebody_else_s_websocket_is_recognised(connect: Callable[..., Any]) -> None:
    with (
        service(lambda wire: wire.connection.recv(), subprotocols=None) as url,
        pytest.raises(fervor_client.Unreachable, match=r"does not speak fervor\.v1\.json"),
    ):
        connect(url)


def test_somebody_else_s_server_is_recognised(connect: Callable[..., Any]) -> None:
    def talk() -> None:
        peer, _ = listener.accept()
        with peer:
            peer.recv(4096)
            peer.sendall(b"220 mail.example ESMTP\r\n")

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=talk)
        thread.start()
        with pytest.raises(fervor_client.Unreachable, match=r"is no HTTP/1\.1"):
            connect(f"ws://127.0.0.1:{listener.getsockname()[1]}")
        thread.join()


# --- what only one twin can do ---------------------------------------------------------------------------------------


async def test_a_cancelled_estimate_leaves_the_session_in_order() -> None:
    arrived, go = threading.Event(), threading.Event()

    def script(wire: Wire) -> None:
        wire.open()
        (first,) = wire.frames_of(1)
        arrived.set()
        assert go.wait(10)
        wire.send(answer(first), answer(wire.frames_of(1)[0]))
        wire.end()

    with service(script) as url:
        async with fervor_client.connect(url) as session:
            task = asyncio.create_task(session.estimate(POSE))
            await asyncio.to_thread(arrived.wait)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            go.set()
            await session.send(POSE)
            await session.end()
            assert [estimate.seq async for estimate in session] == [0, 1]


async def test_many_tasks_share_a_session() -> None:
    with service(echo) as url:
        async with fervor_client.connect(url, window=4) as session:
            bodies = [f"body {n}" for n in range(20)]
            told = await asyncio.gather(*(session.estimate(POSE, body=body) for body in bodies))
            assert [estimate.body for estimate in told] == bodies


def test_many_threads_share_a_session() -> None:
    told: dict[str, list[int]] = {f"body {n}": [] for n in range(8)}
    with service(echo) as url, fervor_client.sync.connect(url, window=4) as session:

        def follow(body: str) -> None:
            for _ in range(10):
                told[body].append(session.estimate(POSE, body=body).seq)

        threads = [threading.Thread(target=follow, args=(body,)) for body in told]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(20)
    assert all(seqs == list(range(10)) for seqs in told.values())


def test_the_sync_session_reads_in_one_thread_what_another_sends() -> None:
    with service(echo) as url, fervor_client.sync.connect(url) as session:
        read: list[int] = []
        reader = threading.Thread(target=lambda: read.extend(estimate.seq for estimate in session))
        reader.start()
        for _ in range(30):
            session.send(POSE)
        session.end()
        reader.join(10)
        assert read == list(range(30))


def test_the_sync_session_can_be_asked_with_a_time_limit() -> None:
    with service(echo) as url, fervor_client.sync.connect(url) as session, pytest.raises(TimeoutError):
        session.recv(timeout=0.01)
