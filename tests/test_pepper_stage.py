"""Where acts happen: gestures chosen from what the robot has, faults told, and nothing done late."""

import queue
import threading
from dataclasses import dataclass, field
from typing import Any

import pytest

from fervor.levels import Level
from fervor_pepper.acts import Act, Voice, pick_gesture
from fervor_pepper.robot import RobotAway, RobotError
from fervor_pepper.stage import Outcome, Stage

VOICE = Voice("en", "English")


@dataclass
class Puppet:
    """A robot of twenty lines, which does as the test says."""

    has: frozenset[str] | None = None
    fault: Exception | None = None
    hold: threading.Event | None = None
    done: list[Act] = field(default_factory=list)

    def animations(self) -> frozenset[str] | None:
        return self.has

    def perform(self, act: Act) -> str | None:
        if self.hold is not None:
            assert self.hold.wait(30)
        if self.fault is not None:
            raise self.fault
        self.done.append(act)
        return act.gestures[0] if act.gestures else None

    def stop(self) -> None:
        if self.hold is not None:
            self.hold.set()


def outcomes(robot: Puppet, *acts: Act) -> list[Outcome]:
    told: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
    stage = Stage(robot, told.put)
    stage.open()
    found = []
    for act in acts:
        stage.start(act)
        found.append(told.get(timeout=30))
    stage.close(30)
    return found


def strong(**fields: Any) -> Act:
    return Act(1, VOICE, **({"gestures": ("best", "good", "poor"), "emotion": "joy", "level": Level.STRONG} | fields))


def test_the_first_gesture_that_is_there_is_chosen() -> None:
    robot = Puppet(has=frozenset({"poor", "good", "other"}))
    (outcome,) = outcomes(robot, strong())
    assert (outcome.gesture, outcome.error) == ("good", None)
    assert robot.done[0].gestures == ("good",)
    assert pick_gesture(("a", "b"), None) == ("a", "b")


def test_a_robot_with_none_of_the_gestures_says_so() -> None:
    robot = Puppet(has=frozenset({"other"}))
    (outcome,) = outcomes(robot, strong())
    assert outcome.error is not None
    assert outcome.error.message == "the robot has no gesture for strong joy; expected one of best, good, poor"
    assert outcome.reached
    assert robot.done == []
    (outcome,) = outcomes(robot, strong(say="hooray"))  # then it speaks at least
    assert (outcome.gesture, outcome.error, robot.done[0].say) == (None, None, "hooray")


@pytest.mark.parametrize(
    ("fault", "reached", "said"),
    [
        (RobotError("no voice"), True, "no voice"),
        (RobotAway("gone"), False, "gone"),
        (ZeroDivisionError("somebody's fault"), True, "the robot failed: ZeroDivisionError: somebody's fault"),
    ],
)
def test_faults_are_told_and_the_next_act_is_done(fault: Exception, reached: bool, said: str) -> None:
    robot = Puppet(fault=fault)
    first, second = outcomes(robot, strong(), strong())
    assert first.error is not None
    assert (first.error.message, first.reached) == (said, reached)
    assert second.error is not None


def test_an_act_that_comes_while_another_hangs_fails_at_once() -> None:
    robot = Puppet(hold=threading.Event())
    told: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
    stage = Stage(robot, told.put)
    stage.open()
    stage.start(Act(1, VOICE, say="long"))
    stage.start(Act(2, VOICE, say="late"))
    refused = told.get(timeout=30)
    assert refused.act.number == 2
    assert not refused.reached
    stage.stop()
    assert told.get(timeout=30) == Outcome(Act(1, VOICE, say="long"))
    stage.close(30)
    assert [act.number for act in robot.done] == [1]
