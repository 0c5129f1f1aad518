"""The load generator, against a service that only pretends. No test depends on how fast either is."""

import os
import signal
import socket
import threading
from dataclasses import replace

import numpy as np
import pytest

import speaking
from fervor_bench.contestant import Running
from fervor_bench.errors import BenchError
from fervor_bench.generator import Generator, Load
from fervor_bench.machine import Places
from fervor_bench.native import build
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track, Trial, conclude

SHORT = Load(3, warmup_s=0.2, seconds=0.6)


@pytest.fixture
def track(workshop):
    anywhere = min(os.sched_getaffinity(0))
    return lambda **traffic: Track(workshop, Places(anywhere, anywhere), Traffic(**traffic))


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
@pytest.mark.parametrize(("bodies", "frames"), [(1, 1), (1, 4), (4, 1), (2, 4)])
def test_every_frame_that_was_due_is_answered_and_matched(track, encoding, bodies: int, frames: int) -> None:
    asked: list[dict] = []

    def answer(message: dict) -> list[dict]:
        asked.append(message)
        return speaking.answer(message)

    with speaking.speaking(answer) as running:
        trial = track(encoding=encoding, bodies=bodies, frames_per_message=frames).run(running, SHORT)
    assert trial.unanswered == 0
    assert trial.failures == ()
    assert 0 < trial.latency.p50_ms <= trial.latency.p99_ms <= trial.latency.largest_ms < float("inf")
    sent = [frame["seq"] for message in asked[:] for frame in message.get("frames", [message]) if "seq" in frame]
    for session_frames in (sent.count(seq) for seq in set(sent)):
        assert session_frames <= 3  # each session sends each frame once
    assert sent.count(0) == 3


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
@pytest.mark.parametrize(("bodies", "frames"), [(1, 1), (1, 6), (4, 1)])
@pytest.mark.parametrize("waits", ["spin", "sleep"])
def test_what_goes_ahead_is_answered_and_not_measured(track, encoding, bodies: int, frames: int, waits) -> None:
    load = replace(SHORT, settle_s=2.0, waits=waits)
    with speaking.speaking() as running:
        trial = track(encoding=encoding, bodies=bodies, frames_per_message=frames).run(running, load)
    assert trial.unanswered == 0
    assert trial.failures == ()
    # In the window as many as are due in it, though all that went ahead came much faster.
    assert trial.frames_per_second <= 3 * 30 * bodies * 1.5
    assert 0 < trial.latency.p50_ms < float("inf")


@pytest.mark.parametrize("loop", ["open", "closed"])
def test_what_goes_ahead_comes_first_and_only_once(track, loop) -> None:
    asked: list[int] = []

    def answer(message: dict) -> list[dict]:
        if "seq" in message:
            asked.append(message["seq"])
        return speaking.answer(message)

    with speaking.speaking(answer) as running:
        trial = track().run(running, Load(1, loop, warmup_s=0.1, seconds=0.3, settle_s=1.0, waits="spin"))
    assert asked == list(range(len(asked)))
    assert len(asked) > 30
    assert trial.unanswered == 0


def test_a_closed_loop_has_one_message_of_a_session_under_way(track) -> None:
    open_now = {"now": 0, "most": 0}
    lock = threading.Lock()

    def answer(message: dict) -> list[dict]:
        with lock:
            open_now["now"] += 1
            open_now["most"] = max(open_now["most"], open_now["now"])
        answers = speaking.answer(message)
        with lock:
            open_now["now"] -= 1
        return answers

    with speaking.speaking(answer) as running:
        trial = track().run(running, replace(SHORT, loop="closed"))
    assert trial.frames_per_second > 0
    assert trial.unanswered == 0
    assert open_now["most"] <= 3


def test_checkpoints_are_counted_and_are_no_answers(track) -> None:
    def answer(message: dict) -> list[dict]:
        checkpoint = {"type": "checkpoint", "body": "0", "seq": message.get("seq", 0), "token": "x"}
        return [checkpoint, *speaking.answer(message)] if message["type"] == "frame" else speaking.answer(message)

    with speaking.speaking(answer) as running:
        trial = track(encoding="json").run(running, SHORT)
    assert trial.checkpoints > 0
    assert trial.unanswered == 0
    assert trial.failures == ()


def test_frames_without_an_answer_are_told(track) -> None:
    silent = {"type": "pong"}
    with speaking.speaking(
        lambda message: [silent] if message.get("seq", 0) % 2 else speaking.answer(message)
    ) as running:
        trial = track().run(running, SHORT)
    assert trial.unanswered > 0
    assert trial.latency.p99_ms == float("inf")
    assert not trial.keeps(1e9)


def test_errors_and_closed_sessions_are_told(track) -> None:
    def answer(message: dict) -> list[dict]:
        if message.get("seq", 0) == 10:
            raise ConnectionError
        if message.get("seq", 0) == 5:
            return [{"type": "error", "code": "bad_frame", "message": "no"}]
        return speaking.answer(message)

    with speaking.speaking(answer) as running:
        trial = track(encoding="json").run(running, SHORT)
    assert "3 sessions closed" in trial.failures
    assert any("errors" in failure and "bad_frame" in failure for failure in trial.failures)
    assert not trial.keeps(1e9)


def test_a_service_that_is_not_there_is_told(track) -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with pytest.raises(BenchError, match="none of 3 sessions could be started"):
        track().run(Running("127.0.0.1", port), SHORT)


def test_a_refusal_is_told_with_its_status(track, live) -> None:
    host, port = live.address.split(":")
    with pytest.raises(BenchError, match=r"404|403"):
        track().run(Running(host, int(port), path="/v1/nowhere"), SHORT)


def test_a_generator_that_was_held_up_says_so(workshop) -> None:
    """Stopped for a while in its window, it can't have kept its schedule."""
    load = replace(SHORT, seconds=1.0)
    traffic, script = Traffic(), workshop / "held"
    with speaking.speaking() as running:
        traffic.write(script, address=running.address, target=running.path, variants=1, messages=100)
        with Generator(
            build("load", workshop),
            script,
            address=(running.host, running.port),
            most=load.sessions,
            arrivals=load.arrivals,
            settle=0,
            processor=min(os.sched_getaffinity(0)),
            result=workshop / "held-result",
        ) as generator:
            generator.open(load.sessions)
            pid = generator._process.pid

            def hold_up() -> None:
                os.kill(pid, signal.SIGSTOP)
                threading.Timer(0.3, os.kill, (pid, signal.SIGCONT)).start()

            seen = generator.run(load, hold_up, lambda: None)
    trial = conclude(load, seen, None)
    assert trial.lag_p99_ms >= 100
    assert not trial.valid
    assert "the generator lagged" in trial.objections[0]
    assert trial.latency.largest_ms >= 100  # counted from when frames were due, not from when they left
    assert isinstance(trial, Trial)
    assert np.isfinite(seen.latencies).all()
