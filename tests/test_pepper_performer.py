"""The behaviour core: one act at a time, pauses kept, and fillers that no estimate can move."""

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fervor.protocol.messages import Estimate
from fervor_pepper.acts import Act
from fervor_pepper.behaviour import Fillers, Timing
from fervor_pepper.performer import STOP_S
from fervor_pepper.phase import TRANSITIONS, Phase
from shows import HASTY, Show, behaviour, estimate, show

TIMING = Timing(settle_s=0.5, rest_s=1.0, emotion_rest_s=4.0, act_timeout_s=6.0)

ESTIMATES = st.builds(
    estimate,
    st.sampled_from(["joy", "surprise", "sadness", "anger", "unknown"]),
    st.sampled_from(["weak", "strong", None]),
    body=st.sampled_from(["a", "b"]),
    status=st.sampled_from(["ok", "ok", "ok", "warming_up", "insufficient"]),
    flags=st.sampled_from([(), (), (), ("reset",), ("lost",), ("late",), ("gap_reset",)]),
    intensity=st.floats(0, 1),
)
EVENTS = st.lists(
    st.tuples(
        st.sampled_from([0.0, 0.1, 0.3, 1.0, 3.0, 7.0]),
        st.one_of(ESTIMATES, ESTIMATES, st.sampled_from(["end", "fail", "away", "leave", "tick"])),
    ),
    max_size=120,
)


def play(stage: Show, events: list[tuple[float, Any]]) -> list[tuple[float, float | None]]:
    """Run events; for each act that ended by being told so, when it began and ended."""
    ends: dict[int, float] = {}
    for seconds, event in events:
        stage.wait(seconds)
        busy = stage.performer.phase in (Phase.ACTING, Phase.STOPPING)
        if isinstance(event, Estimate):
            stage.perceive(event)
        elif event == "leave":
            stage.performer.leave("a")
        elif event != "tick" and busy:
            ends[len(stage.acts)] = stage.now
            stage.end() if event == "end" else stage.fail(reached=event == "fail")
    return [(began, ends.get(number)) for number, (began, _) in enumerate(stage.acts, 1)]


@settings(deadline=None)
@given(EVENTS)
def test_acts_never_overlap_and_rests_are_kept(events: list[tuple[float, Any]]) -> None:
    stage = show(behaviour(timing=TIMING))
    spans = play(stage, events)
    for (began, ended), (following, _) in pairwise(spans):
        # An act that nobody ended is given up after its timeout and the time to stop.
        least = began + TIMING.act_timeout_s + STOP_S if ended is None else ended
        assert following >= least + TIMING.rest_s
    assert [act.number for _, act in stage.acts] == list(range(1, len(stage.acts) + 1))


@settings(deadline=None)
@given(EVENTS)
def test_an_emotion_rests_after_an_act_for_it(events: list[tuple[float, Any]]) -> None:
    kept = [(seconds, "end" if event == "away" else event) for seconds, event in events]
    stage = show(behaviour(timing=TIMING))
    spans = play(stage, kept)
    free: dict[str | None, float] = {}
    for (began, ended), (_, act) in zip(spans, stage.acts, strict=True):
        assert began >= free.get(act.emotion, 0.0)
        free[act.emotion] = (began if ended is None else ended) + TIMING.emotion_rest_s


@settings(deadline=None)
@given(EVENTS)
def test_acts_answer_what_was_seen_by_trustworthy_estimates(events: list[tuple[float, Any]]) -> None:
    stage = show(behaviour(timing=TIMING))
    play(stage, events)
    trusted = {
        (event.body, event.emotion, event.level)
        for _, event in events
        if isinstance(event, Estimate) and event.status == "ok"
    }
    for _, act in stage.acts:
        assert (act.body, act.emotion, act.level) in trusted
        assert bool(act.say) == (act.level == "weak")
        assert bool(act.gestures) == (act.level == "strong")


@settings(deadline=None)
@given(EVENTS, EVENTS, st.integers(0, 5))
def test_fillers_are_the_same_whatever_is_shown(
    events: list[tuple[float, Any]], others: list[tuple[float, Any]], seed: int
) -> None:
    def fillers(seen: list[tuple[float, Any]]) -> list[tuple[float, Act]]:
        stage = show(behaviour(fillers=Fillers(least_s=1.0, most_s=3.0)), "none", seed)
        pending = [event for _, event in seen if isinstance(event, Estimate)]
        for _ in range(300):
            stage.wait(0.1)
            for _ in range(len(pending) // 300 + 1):
                if pending:
                    stage.perceive(pending.pop())
            if stage.performer.phase is Phase.ACTING and stage.now - stage.acts[-1][0] >= 0.5:
                stage.end()
        return stage.acts

    acts = fillers(events)
    assert acts == fillers(others)
    assert len(acts) >= 5


@settings(deadline=None)
@given(st.integers())
def test_fillers_keep_to_their_rate_and_do_not_repeat(seed: int) -> None:
    stage = show(behaviour(fillers=Fillers(least_s=4.0, most_s=9.0)), "none", seed)
    for _ in range(1200):
        stage.wait(0.1)
        if stage.performer.phase is Phase.ACTING:
            stage.end()
    pauses = [after - before for (before, _), (after, _) in pairwise(stage.acts)]
    assert min(pauses) >= 4.0 - 0.11
    assert max(pauses) <= 9.0 + 0.11
    assert all(a != b for a, b in pairwise(stage.said))
    assert set(stage.said) <= set(behaviour().words.fillers)


def test_the_same_seed_gives_the_same_words_and_another_one_others() -> None:
    def words(seed: int) -> list[str | None]:
        stage = show(behaviour(timing=HASTY), seed=seed)
        for _ in range(10):
            stage.watch(0.1, "joy").end().watch(0.1, "unknown")
        return stage.said

    assert words(1) == words(1)
    assert len({tuple(words(seed)) for seed in range(5)}) > 1


def test_weak_is_answered_by_the_papers_kind_of_line_and_strong_by_a_gesture() -> None:
    stage = show(behaviour(timing=HASTY))
    for emotion in ("joy", "surprise", "sadness"):
        stage.watch(0.1, emotion, "weak").end().watch(0.1, emotion, "strong").end()
        (_, weak), (_, strong) = stage.acts[-2:]
        assert weak.say in behaviour().lines(emotion, weak.level)  # type: ignore[arg-type]
        assert weak.gestures == ()
        assert (strong.say, strong.gestures[0].split("/")[0]) == (None, "animations")


def test_what_goes_on_is_answered_once_and_a_change_again() -> None:
    stage = show(behaviour(timing=HASTY))
    stage.watch(5.0, "joy", "weak").end().watch(5.0, "joy", "weak")
    assert stage.shown == ["weak joy 0"]
    stage.watch(1.0, "joy", "strong").end().watch(1.0, "joy", "weak").end()
    assert stage.shown[1:] == ["strong joy 0", "weak joy 0"]
    stage.watch(1.0, "anger", "weak").watch(1.0, "joy", "weak")  # nothing is said to anger, but it was between
    assert stage.shown[3:] == ["weak joy 0"]


def test_a_change_while_resting_is_answered_after_the_rest_if_it_still_shows() -> None:
    stage = show(behaviour(timing=TIMING))
    stage.watch(1.0, "joy", "weak").end()
    ended = stage.now
    stage.watch(10.0, "joy", "strong")
    assert stage.shown == ["weak joy 0", "strong joy 0"]
    assert stage.acts[1][0] == pytest.approx(ended + TIMING.emotion_rest_s, abs=0.11)
    other = show(behaviour(timing=TIMING))
    other.watch(1.0, "joy", "weak").end().watch(2.0, "joy", "strong").watch(10.0, "neutral", "weak")
    assert other.shown == ["weak joy 0"]


def test_an_act_that_takes_too_long_is_stopped_and_then_given_up() -> None:
    stage = show(behaviour(timing=TIMING))
    stage.watch(0.7, "joy", "weak").wait(TIMING.act_timeout_s)
    assert (stage.stops, stage.performer.phase) == ([1], Phase.STOPPING)
    stage.wait(STOP_S)
    assert (stage.stops, stage.performer.phase) == ([1], Phase.RESTING)
    stage.end()  # news of an act that was given up
    assert stage.performer.phase is Phase.RESTING


def test_an_act_that_never_reached_the_robot_is_owed_again_at_once() -> None:
    stage = show(behaviour(timing=TIMING))
    stage.watch(0.7, "joy", "weak").fail(reached=False).watch(TIMING.rest_s + 0.2, "joy", "weak")
    assert stage.shown == ["weak joy 0"] * 2
    stage.fail(reached=True).watch(10.0, "joy", "weak")
    assert stage.shown == ["weak joy 0"] * 2


def test_the_table_lets_acts_begin_from_rest_alone() -> None:
    assert {before for (before, _), after in TRANSITIONS.items() if after is Phase.ACTING} == {Phase.IDLE}
    reached = set(TRANSITIONS.values()) | {Phase.IDLE}
    assert reached == set(Phase) == {before for before, _ in TRANSITIONS}
