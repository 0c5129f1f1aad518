"""Both twins against real services behind a network that fails: cut in mid-message, refused, restarted, replaced."""

import random
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from http import HTTPStatus
from typing import Any

import numpy as np
import pytest

import fervor_client
from bodies import motion
from fervor.errors import CheckpointUnknown, Overloaded
from fervor_client import Estimate, Reconnect
from live import Live, running
from test_client_sessions import POSE, Wire, answer, service, twin  # noqa: F401  # the fixture `connect`

POSES = motion(240)
KEY = "a key for all the replicas"


class Network:
    """A proxy in front of a service, which can be told to fail."""

    def __init__(self, target: str) -> None:
        self.target = target
        self.dice = random.Random(0)
        self.most_bytes: tuple[int, int] | None = None
        self.down = False
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"ws://127.0.0.1:{self._listener.getsockname()[1]}"
        self._open: set[socket.socket] = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        for end in list(self._open):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._listener.close()
        self.cut()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                if self.down:
                    client.close()
                    continue
                host, port = self.target.split(":")
                server = socket.create_connection((host, int(port)))
                limit = self.dice.randint(*self.most_bytes) if self.most_bytes else None
                for source, sink in ((client, server), (server, client)):
                    self._open.add(source)
                    threading.Thread(target=self._carry, args=(source, sink, limit), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket, limit: int | None) -> None:
        """Bytes from one end to the other; after `limit` of them the line goes dead, wherever that is."""
        carried = 0
        with suppress(OSError):
            while chunk := source.recv(4096):
                if limit is not None and carried + len(chunk) > limit:
                    sink.sendall(chunk[: limit - carried])
                    break
                sink.sendall(chunk)
                carried += len(chunk)
        for end in (source, sink):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._open.discard(source)
        source.close()


@contextmanager
def network(live: Live) -> Iterator[Network]:
    line = Network(live.address)
    try:
        yield line
    finally:
        line.close()


@pytest.fixture(scope="module")
def replicas() -> Iterator[list[Live]]:
    """Services with the same key."""
    with ExitStack() as stack:
        yield [stack.enter_context(running(checkpoint_keys=KEY, max_frames_per_second=1e6)) for _ in range(2)]


@pytest.fixture(scope="module")
def expected(replicas: list[Live]) -> list[Estimate]:
    """Of a stream that nothing happens to."""
    with fervor_client.sync.connect(replicas[0].stream, emotion="joy") as session:
        send(session, range(len(POSES)))
        session.end()
        return list(session)


def send(session: Any, numbers: range) -> None:
    for number in numbers:
        session.send(POSES[number], t=number / 30)


def estimate(session: Any, numbers: range) -> list[Estimate]:
    return [session.estimate(POSES[number], t=number / 30, timeout=30) for number in numbers]


class Diary:
    """What `on_reconnect` was told."""

    def __init__(self) -> None:
        self.told: list[Reconnect] = []
        self.back = threading.Event()
        self.failed = threading.Event()

    def __call__(self, news: Reconnect) -> None:
        self.told.append(news)
        if news.delay_s is None:
            self.back.set()
        elif news.attempt >= 3:
            self.failed.set()


def test_a_line_that_is_cut_in_mid_message_over_and_over_changes_nothing(
    connect: Callable[..., Any],
    replicas: list[Live],
    expected: list[Estimate],
) -> None:
    with network(replicas[0]) as line:
        line.most_bytes = (60_000, 120_000)
        with connect(line.url, emotion="joy", window=16) as session:
            send(session, range(len(POSES)))
            totals = session.end(timeout=60)
            assert list(session) == expected
            assert session.reconnects >= 2
            assert totals.frames == totals.estimates == len(POSES)


def test_replicas_take_over_from_each_other(
    connect: Callable[..., Any],
    replicas: list[Live],
    expected: list[Estimate],
) -> None:
    with network(replicas[0]) as line, connect(line.url, emotion="joy") as session:
        told = []
        for hop in range(6):
            line.target = replicas[(hop + 1) % 2].address
            line.cut()
            told += estimate(session, range(hop * 40, hop * 40 + 40))
        assert told == expected
        assert session.reconnects == 6


def test_a_service_that_is_stopped_hands_over_to_the_next(
    connect: Callable[..., Any],
    replicas: list[Live],
    expected: list[Estimate],
) -> None:
    diary = Diary()
    with (
        running(checkpoint_keys=KEY) as first,
        network(first) as line,
        connect(line.url, emotion="joy", on_reconnect=diary, checkpoint_s=60.0) as session,
    ):
        told = estimate(session, range(100))
        line.target = replicas[1].address
        first.stop()
        told += estimate(session, range(100, 240))
        assert told == expected
    assert "1012" in str(diary.told[0].reason)
    assert diary.told[-1].anew == ()


def test_a_service_that_is_away_for_a_while_is_waited_for(
    connect: Callable[..., Any],
    replicas: list[Live],
    expected: list[Estimate],
) -> None:
    diary = Diary()
    with network(replicas[0]) as line, connect(line.url, emotion="joy", on_reconnect=diary) as session:
        send(session, range(50))
        line.down = True
        line.cut()
        send(session, range(50, 150))
        asked: list[Estimate] = []
        waiting = threading.Thread(target=lambda: asked.extend(estimate(session, range(150, 151))))
        waiting.start()
        assert diary.failed.wait(20)
        line.down = False
        waiting.join(30)
        send(session, range(151, 240))
        session.end(timeout=30)
        assert sorted([*session, *asked], key=lambda told: told.seq) == expected
    attempts = [news.attempt for news in diary.told if news.delay_s is not None]
    assert attempts == list(range(1, len(attempts) + 1))


def test_a_service_with_another_key_starts_the_body_anew_and_says_so(
    connect: Callable[..., Any],
    replicas: list[Live],
    start_service: Callable[..., Live],
) -> None:
    diary = Diary()
    other = start_service(checkpoint_keys="quite another key than theirs")
    with network(replicas[0]) as line, connect(line.url, on_reconnect=diary) as session:
        session.send(POSES[0], t=0.0, emotion="fear")
        told = estimate(session, range(1, 60))
        assert session.recv().seq == 0
        line.target = other.address
        line.cut()
        told += estimate(session, range(60, 100))
    assert [number.seq for number in told] == list(range(1, 100))
    assert [number.seq for number in told if "reset" in number.flags] == [60]
    assert {number.emotion for number in told} == {"fear"}
    assert diary.told[-1].anew == ("0",)
    assert isinstance(diary.told[-1].reason, CheckpointUnknown)


def test_a_session_that_nobody_takes_back_is_lost_with_a_sentence(
    connect: Callable[..., Any],
    replicas: list[Live],
) -> None:
    with network(replicas[0]) as line, connect(line.url, retry_for=0.4) as session:
        first = session.estimate(POSES[0], t=0.0)
        session.send(POSES[1], t=0.1)
        line.down = True
        line.cut()
        with pytest.raises(fervor_client.Unreachable, match=r"closed the connection .*; tried to reconnect .* in \d s"):
            [session.recv() for _ in range(3)]
        with pytest.raises(fervor_client.Unreachable, match="tried to reconnect"):
            session.estimate(POSES[2], t=0.2)
        assert first.seq == 0


def test_a_session_is_closed_while_it_is_cut(connect: Callable[..., Any], replicas: list[Live]) -> None:
    diary = Diary()
    with network(replicas[0]) as line:
        session = connect(line.url, retry_for=None, on_reconnect=diary)
        session.send(POSES[0], t=0.0)
        line.down = True
        line.cut()
        assert diary.failed.wait(20)
        session.close()
        with pytest.raises(fervor_client.Unreachable, match="has ended"):
            session.send(POSES[1], t=0.1)


def test_a_session_can_be_ended_while_it_is_cut(
    connect: Callable[..., Any],
    replicas: list[Live],
    expected: list[Estimate],
) -> None:
    diary = Diary()
    with network(replicas[0]) as line, connect(line.url, emotion="joy", on_reconnect=diary) as session:
        line.down = True
        line.cut()
        send(session, range(240))
        assert diary.failed.wait(20)
        line.down = False
        assert session.end(timeout=30).estimates == 240
        assert list(session) == expected


def test_a_full_service_is_asked_again_when_it_says(connect: Callable[..., Any]) -> None:
    asked = iter([None, 503, 503, None, None])
    diary = Diary()

    def admit(connection: Any, _request: Any) -> Any:
        status = next(asked)
        if status is None:
            return None
        response = connection.respond(HTTPStatus(status), '{"detail": "The house is full."}')
        response.headers["Retry-After"] = "1"
        return response

    def script(wire: Wire) -> None:
        wire.open()
        frames = wire.frames_of(1)
        if frames[0].seq == 0 and not diary.told:
            wire.cut()
        wire.send(answer(frames[0]))
        wire.end()

    with service(script, process_request=admit) as url, connect(url, on_reconnect=diary) as session:
        assert session.estimate(POSE).seq == 0
    assert [type(news.reason) for news in diary.told[1:3]] == [Overloaded, Overloaded]
    assert all(news.delay_s is not None and news.delay_s >= 1.0 for news in diary.told[1:3])


def test_what_an_on_reconnect_raises_harms_nothing(
    connect: Callable[..., Any],
    replicas: list[Live],
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(news: Reconnect) -> None:
        raise ZeroDivisionError

    with network(replicas[0]) as line, connect(line.url, on_reconnect=fail) as session:
        session.estimate(POSES[0], t=0.0)
        line.cut()
        assert session.estimate(POSES[1], t=0.1).seq == 1
    assert "on_reconnect failed for" in caplog.text


def test_by_default_it_is_logged(
    connect: Callable[..., Any],
    replicas: list[Live],
    caplog: pytest.LogCaptureFixture,
) -> None:
    with network(replicas[0]) as line, connect(line.url) as session:
        session.estimate(POSES[0], t=0.0)
        line.cut()
        session.estimate(np.asarray(POSES[1]), t=0.1)
    assert "attempt 1 to reconnect follows in 0." in caplog.text
    assert "the stream goes on after" in caplog.text
