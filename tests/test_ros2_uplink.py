"""The ROS node's line to a real service, behind a network that fails."""

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from bodies import motion
from fervor.errors import Unreachable
from fervor_client import Estimate, sync
from fervor_ros import uplink as uplink_module
from fervor_ros.health import Severity, health
from fervor_ros.perception import Frame
from fervor_ros.uplink import Line, Uplink
from live import Live
from test_client_reconnect import network
from waiting import until

POSES = motion(90, joints=13)


def frames(count: int, *, body: str = "b1", first: int = 1, emotion: str = "joy") -> list[Frame]:
    return [Frame(body, first + n, n / 30, POSES[n % len(POSES)], emotion) for n in range(count)]


def plain(live: Live, told: list[Frame]) -> list[Estimate]:
    """What the client alone gets for the same frames."""
    with sync.connect(live.stream) as session:
        for frame in told:
            session.send(frame.rotations, body=frame.body, seq=frame.seq, t=frame.t, emotion=frame.emotion)
        session.end()
        return list(session)


def dial(url: str) -> uplink_module.OpenSession:
    return lambda on_error, on_reconnect: sync.connect(
        url, on_error=on_error, on_reconnect=on_reconnect, retry_for=None
    )


@contextmanager
def running(open_session: uplink_module.OpenSession) -> Iterator[tuple[Uplink, Callable[[int], list[Estimate]]]]:
    """A line, and a function that waits for so many estimates."""
    heard: queue.SimpleQueue[Estimate] = queue.SimpleQueue()
    line = Uplink(open_session, heard.put)
    line.start()
    try:
        yield line, lambda count: [heard.get(timeout=60) for _ in range(count)]
    finally:
        line.close()


def test_estimates_are_those_of_the_plain_client(live: Live) -> None:
    told = frames(90)
    with running(dial(live.stream)) as (line, wait):
        for frame in told:
            line.send(frame)
        assert wait(90) == plain(live, told)
        assert (line.line.connected, line.line.sent, line.line.answered, line.line.dropped) == (True, 90, 90, 0)
        assert line.line.model is not None
    assert not line.line.connected


def test_a_service_that_comes_late_gets_all_there_is(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uplink_module, "FIRST_PAUSE_S", 0.01)
    with network(live) as way:
        way.down = True
        with running(dial(way.url)) as (line, wait):
            for frame in frames(60):
                line.send(frame)
            until(lambda: line.line.trouble)
            way.down = False
            assert wait(60) == plain(live, frames(60))
            assert line.line.trouble == ""


def test_a_cut_is_mended_to_the_bit(live: Live) -> None:
    told = frames(90)
    with network(live) as way, running(dial(way.url)) as (line, wait):
        for frame in told[:45]:
            line.send(frame)
        early = wait(45)
        way.cut()
        for frame in told[45:]:
            line.send(frame)
        assert early + wait(45) == plain(live, told)
        assert (line.line.reconnects, line.line.sessions) == (1, 1)


def test_too_many_frames_push_out_the_oldest(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uplink_module, "MOST_QUEUED", 20)
    open_now = threading.Event()

    def wait_and_dial(*callbacks: Any) -> sync.Session:
        assert open_now.wait(60)
        return dial(live.stream)(*callbacks)

    told = frames(30)
    with running(wait_and_dial) as (line, wait):
        for frame in told[:25]:
            line.send(frame)
        line.end_body("elsewhere")  # nobody's end is pushed out
        for frame in told[25:]:
            line.send(frame)
        open_now.set()
        assert wait(20) == plain(live, told[10:])
        assert (line.line.dropped, line.line.sent) == (10, 20)


def test_a_body_that_ends_begins_anew(live: Live) -> None:
    with running(dial(live.stream)) as (line, wait):
        for frame in frames(60):
            line.send(frame)
        line.end_body("b1")
        line.end_body("never seen")
        again = frames(60, first=61)
        for frame in again:
            line.send(frame)
        assert wait(120)[60:] == plain(live, again)
        assert line.line.refused == 0


def test_a_session_that_is_lost_for_good_is_followed_by_another(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uplink_module, "FIRST_PAUSE_S", 0.01)
    opened: list[sync.Session] = []

    def dial_once(on_error: Any, on_reconnect: Any) -> sync.Session:
        opened.append(sync.connect(live.stream, on_error=on_error, on_reconnect=on_reconnect, resume=False))
        return opened[-1]

    with running(dial_once) as (line, wait):
        line.send(frames(1)[0])
        wait(1)
        opened[0].close()
        until(lambda: line.line.sessions == 2)
        line.send(frames(1, first=2)[0])
        (estimate,) = wait(1)
        assert estimate.seq == 2


def test_what_the_service_refuses_harms_nothing_else(live: Live) -> None:
    wrong = Frame("b1", 1, 0.0, np.full((13, 4), np.inf), "joy")
    unheard_of = Frame("b1", 2, 0.0, POSES[0], "no emotion")
    with running(dial(live.stream)) as (line, wait):
        for frame in (wrong, unheard_of, *frames(1, first=3)):
            line.send(frame)
        (estimate,) = wait(1)
        assert estimate.seq == 3
        until(lambda: line.line.refused == 2)


def test_it_closes_while_nobody_answers() -> None:
    def nobody(*callbacks: Any) -> sync.Session:
        raise Unreachable("nobody is there")

    with running(nobody) as (line, _):
        until(lambda: line.line.trouble == "nobody is there")
    assert not line._worker.is_alive()


@pytest.mark.parametrize(
    ("line", "silent", "severity", "message"),
    [
        (Line(), (), Severity.ERROR, "connecting"),
        (Line(trouble="nobody is there"), (), Severity.ERROR, "nobody is there"),
        (Line(sessions=1, trouble="cut"), (), Severity.WARN, "cut"),
        (Line(connected=True, sessions=1), (), Severity.OK, "streaming"),
        (Line(connected=True, sessions=1), ("b2", "b1"), Severity.WARN, "no poses come of b1, b2"),
    ],
)
def test_health(line: Line, silent: tuple[str, ...], severity: Severity, message: str) -> None:
    found = health(line, service="ws://here", silent=frozenset(silent), bodies=2)
    assert (found.severity, found.message) == (severity, message)
    assert dict(found.values)["bodies"] == "2"


def test_health_names_the_model(live: Live) -> None:
    with running(dial(live.stream)) as (line, _):
        until(lambda: line.line.connected)
        found = health(line.line, service=live.stream, silent=frozenset(), bodies=0)
    assert found.message == "streaming to a demo model"
    assert dict(found.values)["purpose"] == "demo"
