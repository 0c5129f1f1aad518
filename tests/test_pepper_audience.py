"""Who is attended to, and what counts as shown: several people, changes, resets, people who are lost."""

from typing import Any

import pytest

from fervor_pepper.behaviour import Attention
from shows import HASTY, Show, behaviour, estimate, show

NOW = HASTY.model_copy(update={"settle_s": 0.5})


def crowd(to: Any = "intense", *, hold_s: float = 0.0, lost_s: float = 2.0) -> Show:
    return show(behaviour(timing=HASTY, attention=Attention(to=to, hold_s=hold_s, lost_s=lost_s)))


def together(stage: Show, seconds: float, *people: dict[str, Any]) -> None:
    for _ in range(round(seconds * 10)):
        stage.now += 0.1
        for person in people:
            stage.perceive(estimate(**person))


def test_the_most_intense_is_answered() -> None:
    stage = crowd(hold_s=5.0)
    calm = {"body": "calm", "emotion": "joy", "intensity": 0.2}
    lively = {"body": "lively", "emotion": "joy", "level": "strong", "intensity": 0.9}
    together(stage, 0.1, calm)
    stage.end()
    together(stage, 3.0, calm, lively)
    assert stage.shown == ["weak joy calm"]  # it holds on to the first
    together(stage, 3.0, calm, lively)
    assert stage.shown == ["weak joy calm", "strong joy lively"]


def test_the_longest_is_answered() -> None:
    stage = crowd("longest")
    first, second = {"body": "first", "intensity": 0.1}, {"body": "second", "level": "strong", "intensity": 0.9}
    together(stage, 1.0, first)
    stage.end()
    together(stage, 3.0, first, second)
    assert stage.shown == ["weak joy first"]
    stage.performer.leave("first")
    together(stage, 1.0, second)
    assert stage.shown == ["weak joy first", "strong joy second"]


def test_whoever_shows_nothing_is_not_waited_for() -> None:
    stage = crowd(hold_s=100.0)
    together(stage, 1.0, {"body": "idle", "emotion": "unknown"})
    together(stage, 1.0, {"body": "idle", "emotion": "unknown"}, {"body": "other"})
    assert stage.shown == ["weak joy other"]


def test_the_lost_are_new_when_they_are_back() -> None:
    stage = crowd(lost_s=2.0)
    stage.watch(1.0).end().wait(1.0).watch(1.0)
    assert len(stage.acts) == 1
    stage.wait(2.1).watch(1.0)
    assert len(stage.acts) == 2


def test_a_body_without_joints_is_lost_in_the_end() -> None:
    stage = crowd(lost_s=2.0)
    stage.watch(1.0).end().watch(3.0, level=None, intensity=None, status="insufficient", flags=("lost",))
    stage.watch(0.1)
    assert len(stage.acts) == 2


@pytest.mark.parametrize("flag", ["reset", "gap_reset", "clock_reset"])
def test_after_a_reset_a_body_is_new(flag: str) -> None:
    stage = crowd()
    stage.watch(1.0).end().see(flags=(flag,), status="warming_up").watch(1.0)
    assert len(stage.acts) == 2


@pytest.mark.parametrize("flag", ["late", "duplicate"])
def test_old_news_is_no_news(flag: str) -> None:
    stage = crowd()
    stage.watch(1.0).end().watch(1.0, "surprise", flags=(flag,))
    assert len(stage.acts) == 1


@pytest.mark.parametrize("status", ["warming_up", "insufficient", "one of a newer service"])
def test_only_trustworthy_estimates_are_answered(status: str) -> None:
    stage = crowd()
    stage.watch(2.0, status=status)
    assert stage.acts == []
    stage.watch(0.1)
    assert len(stage.acts) == 1


def test_what_flickers_does_not_count() -> None:
    stage = show(behaviour(timing=NOW))
    for _ in range(10):
        stage.watch(0.3, "joy").watch(0.3, "surprise")
    assert stage.acts == []
    stage.watch(0.6, "surprise")
    assert stage.shown == ["weak surprise 0"]


def test_distrust_begins_the_settling_anew() -> None:
    stage = show(behaviour(timing=NOW))
    for _ in range(10):
        stage.watch(0.4, "joy").see("joy", status="insufficient")
    assert stage.acts == []
