"""Sessions that stay from one load to the next, against a service that only pretends."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

import speaking
from fervor_bench.fleet import KEPT_S, MOST_MESSAGES, Fleet, messages_needed, messages_to_settle
from fervor_bench.generator import Load, Seen
from fervor_bench.traffic import Traffic

SHORT = Load(3, warmup_s=0.1, seconds=0.3, settle_s=1.0)


class Listening:
    """Answers, and keeps what it was sent, by session."""

    def __init__(self) -> None:
        self.sessions: list[list[int]] = []

    def conversation(self) -> speaking.Answer:
        seqs: list[int] = []

        def answer(message: dict) -> list[dict]:
            if message["type"] == "session.start":
                self.sessions.append(seqs)
            else:
                seqs.append(message["seq"])
            return speaking.answer(message)

        return answer


@pytest.fixture
def fleet_of(workshop: Path) -> Callable[..., Iterator[Callable[[Load], Seen]]]:
    @contextmanager
    def make(running, most: int, **traffic) -> Iterator[Callable[[Load], Seen]]:
        with Fleet(workshop, min(os.sched_getaffinity(0)), Traffic(**traffic), running, most=most) as fleet:
            yield lambda load: fleet.run(load, lambda: None, lambda: None)

    return make


def test_sessions_go_on_where_they_were(fleet_of) -> None:
    listening = Listening()
    with speaking.speaking_to_each(listening.conversation) as running, fleet_of(running, 5) as run:
        seen = [run(replace(SHORT, sessions=sessions)) for sessions in (3, 3, 5, 2)]
    assert [each.sessions for each in seen] == [3, 3, 5, 2]
    assert len(listening.sessions) == 5  # nobody was begun twice
    for seqs in listening.sessions:
        assert seqs == list(range(len(seqs)))  # every frame once, in order
    settle, window = messages_to_settle(SHORT, Traffic()), 12
    lengths = sorted(len(seqs) for seqs in listening.sessions)
    assert all(settle + window - 2 <= length <= settle + 4 * (window + 2) for length in lengths)
    assert lengths[-1] > settle + 3 * (window - 2)
    for each in seen:
        assert each.unanswered == each.under_way == each.closed == each.refused == 0
        assert not each.lost
        # As many as are due: of the frames that went ahead none is counted.
        assert 30 * 0.3 * each.sessions * 0.6 <= len(each.latencies) <= 30 * 0.3 * each.sessions * 1.4


def test_a_new_session_settles_and_an_old_one_does_not_again(fleet_of) -> None:
    listening = Listening()
    with speaking.speaking_to_each(listening.conversation) as running, fleet_of(running, 2) as run:
        run(replace(SHORT, sessions=1))
        before = len(listening.sessions[0])
        run(replace(SHORT, sessions=2))
    old, new = sorted((len(seqs) for seqs in listening.sessions), reverse=True)
    assert new >= messages_to_settle(SHORT, Traffic()) + 10
    assert old - before <= 14


def test_sessions_are_new_where_they_are_not_kept(fleet_of) -> None:
    listening = Listening()
    with speaking.speaking_to_each(listening.conversation) as running, fleet_of(running, 0) as run:
        run(SHORT)
        run(SHORT)
    assert len(listening.sessions) == 6


def test_sessions_are_new_where_some_were_lost(fleet_of) -> None:
    listening, failed = Listening(), []

    def conversation() -> speaking.Answer:
        answer = listening.conversation()

        def fail_once(message: dict) -> list[dict]:
            if message.get("seq") == 35 and not failed:
                failed.append(True)
                raise ConnectionError
            return answer(message)

        return fail_once

    with speaking.speaking_to_each(conversation) as running, fleet_of(running, 3) as run:
        assert run(SHORT).closed == 1
        seen = run(SHORT)
    assert (seen.sessions, seen.closed) == (3, 0)
    assert len(listening.sessions) == 6


def test_a_script_that_would_not_last_is_followed_by_a_new_one(fleet_of) -> None:
    listening = Listening()
    load = replace(SHORT, sessions=1, warmup_s=0.0, seconds=0.2)
    longer = replace(load, seconds=KEPT_S)
    with speaking.speaking_to_each(listening.conversation) as running, fleet_of(running, 1) as run:
        run(load)
        # Falls behind at once, so it is over at once; the script of the first would not have lasted for it.
        assert run(replace(longer, late_s=-1.0, backlog_s=-1.0)).lost
        assert not run(load).dry
    assert len(listening.sessions) >= 2


@pytest.mark.parametrize("waits", ["spin", "sleep"])
def test_a_service_that_falls_behind_ends_the_window(fleet_of, waits) -> None:
    def silent(message: dict) -> list[dict]:
        return speaking.answer(message) if message.get("seq", 0) < 45 else []

    load = replace(SHORT, seconds=60.0, backlog_s=0.2, waits=waits)
    with speaking.speaking(silent) as running, fleet_of(running, 0) as run:
        seen = run(load)
    assert seen.lost
    assert seen.window_s < 30.0
    assert seen.unanswered > 0
    assert seen.under_way >= seen.unanswered


def test_frames_that_are_known_late_end_the_window(fleet_of) -> None:
    load = replace(SHORT, seconds=60.0, late_s=-1.0)  # every answer is later than this
    with speaking.speaking() as running, fleet_of(running, 0) as run:
        seen = run(load)
    assert seen.lost
    assert seen.window_s < 30.0
    assert seen.unanswered == 0
    late = len(seen.latencies)
    assert late >= 0.01 * 60.0 * 30 * 3  # no earlier than 1 % of the whole window is


def test_a_closed_loop_falls_behind_nobody(fleet_of) -> None:
    load = replace(SHORT, loop="closed", backlog_s=-1.0, late_s=-1.0)
    with speaking.speaking() as running, fleet_of(running, 0) as run:
        assert not run(load).lost


def test_messages_last_for_the_whole_run() -> None:
    assert messages_needed(Load(10, warmup_s=1, seconds=5), Traffic()) == 6 * 30 + 1
    assert messages_needed(Load(10, warmup_s=1, seconds=5), Traffic(frames_per_message=6)) == 31
    assert messages_needed(Load(10, warmup_s=1, seconds=5), Traffic(bodies=4)) == 6 * 30 * 4 + 4
    assert messages_needed(Load(1, loop="closed"), Traffic()) == MOST_MESSAGES


@pytest.mark.parametrize(
    ("bodies", "frames", "messages"), [(1, 1, 60), (1, 6, 10), (4, 1, 240), (4, 2, 120), (2, 4, 30)]
)
def test_what_goes_ahead_is_so_many_seconds_of_every_body(bodies: int, frames: int, messages: int) -> None:
    load, traffic = Load(3, warmup_s=1, seconds=5, settle_s=2), Traffic(bodies=bodies, frames_per_message=frames)
    assert messages_to_settle(load, traffic) == messages
    assert messages_needed(load, traffic) == messages + messages_needed(replace(load, settle_s=0), traffic)
