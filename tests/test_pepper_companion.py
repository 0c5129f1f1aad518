"""The bridge with a real service: poses in, acts out, all of it in the log; neither side's end is the other's."""

import csv
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fervor.errors import FervorError
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor_client import sync
from fervor_pepper import Companion, SessionLog
from fervor_pepper.acts import Act
from fervor_pepper.behaviour import Fillers
from fervor_pepper.robot import RobotAway
from live import Live
from robots import HAPPY, QiRobot, need_qi
from shows import HASTY, behaviour

SAMPLE = Path(__file__).resolve().parents[1] / "service" / "fervor" / "samples" / "joy.bvh"


@pytest.fixture(scope="module")
def sample() -> list[tuple[float, Any]]:
    """The recording that comes with fervor: joy, weak, then strong, then weak; every other frame."""
    times, poses, _ = rig_poses(read_recording(SAMPLE))
    return list(zip(times.tolist(), poses, strict=True))[::2]


@dataclass
class Puppet:
    """A robot that does at once what it is told; where it is `away`, nothing reaches it."""

    acts: list[Act] = field(default_factory=list)
    away: bool = False
    tried: threading.Event = field(default_factory=threading.Event)
    acted: threading.Event = field(default_factory=threading.Event)

    def animations(self) -> frozenset[str]:
        return frozenset({HAPPY})

    def perform(self, act: Act) -> str | None:
        self.tried.set()
        if self.away:
            raise RobotAway("out of reach")
        self.acts.append(act)
        self.acted.set()
        return act.gestures[0] if act.gestures else None

    def stop(self) -> None:
        pass


def feed(companion: Companion, sample: list[tuple[float, Any]], **options: Any) -> None:
    for t, pose in sample:
        companion.feed(pose, t=t, **options)


def test_the_sample_is_answered_by_speech_then_a_gesture_then_speech(
    live: Live, sample: list[tuple[float, Any]], tmp_path: Path
) -> None:
    robot, path = Puppet(), tmp_path / "s.csv"
    log = SessionLog(path, participant="P01", condition="expressive")
    with (
        sync.connect(live.stream) as session,
        Companion(robot, session, behaviour=behaviour(timing=HASTY), log=log) as companion,
    ):
        feed(companion, sample, emotion="joy")
    levels = [act.level for act in robot.acts]
    assert levels[0] == "weak"
    assert "strong" in levels
    assert all(a != b for a, b in pairwise(levels))
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["kind"] for row in (rows[0], rows[-1])] == ["begin", "end"]
    assert sum(row["kind"] == "estimate" for row in rows) == len(sample)
    done = [row for row in rows if row["kind"] == "done"]
    assert [row["said"] or row["gesture"] for row in done] == [act.say or HAPPY for act in robot.acts]


def test_in_mode_none_it_says_fillers_whatever_is_shown(live: Live, sample: list[tuple[float, Any]]) -> None:
    robot = Puppet()
    parts = behaviour(timing=HASTY, fillers=Fillers(least_s=0.01, most_s=0.02))
    with sync.connect(live.stream) as session, Companion(robot, session, mode="none", behaviour=parts) as companion:
        feed(companion, sample[:60], emotion="joy")
        assert robot.acted.wait(30)
    assert {act.say for act in robot.acts} <= set(parts.words.fillers)


def test_a_robot_out_of_reach_gets_the_answer_when_it_is_back(live: Live, sample: list[tuple[float, Any]]) -> None:
    robot = Puppet(away=True)
    with (
        sync.connect(live.stream) as session,
        Companion(robot, session, behaviour=behaviour(timing=HASTY)) as companion,
    ):
        feed(companion, sample[:200], emotion="joy")
        assert robot.tried.wait(30)
        robot.away = False
        # Estimates went on all the while; the next one finds the robot there.
        feed(companion, [(sample[200][0] + 0.03, sample[200][1])])
        assert robot.acted.wait(30)
    assert robot.acts[0].level == "weak"


def test_a_person_who_left_is_new_when_back(live: Live, sample: list[tuple[float, Any]]) -> None:
    robot = Puppet()
    with (
        sync.connect(live.stream) as session,
        Companion(robot, session, behaviour=behaviour(timing=HASTY)) as companion,
    ):
        feed(companion, sample[:100], emotion="joy", body="ann")
        assert robot.acted.wait(30)
        robot.acted.clear()
        companion.leave("ann")
        feed(companion, [(t + 100.0, pose) for t, pose in sample[:100]], emotion="joy", body="ann")
        assert robot.acted.wait(30)
    assert [(act.body, act.level) for act in robot.acts] == [("ann", "weak")] * 2


def test_fillers_go_on_when_the_service_is_gone(
    start_service: Callable[..., Live], caplog: pytest.LogCaptureFixture
) -> None:
    robot = Puppet()
    live = start_service()
    parts = behaviour(timing=HASTY, fillers=Fillers(least_s=0.01, most_s=0.02))
    with (
        sync.connect(live.stream, resume=False) as session,
        Companion(robot, session, mode="none", behaviour=parts) as companion,
    ):
        live.stop()
        with pytest.raises(FervorError):  # noqa: PT012  # the first may leave before the news is here
            while True:
                companion.feed(np.tile([0.0, 0.0, 0.0, 1.0], (13, 1)))
        robot.acted.clear()
        assert robot.acted.wait(30)
    assert "no more estimates come: " in caplog.text


def test_an_exception_ends_it_at_once_and_passes(live: Live) -> None:
    with (
        pytest.raises(ZeroDivisionError),
        sync.connect(live.stream) as session,
        Companion(Puppet(), session),
    ):
        raise ZeroDivisionError
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("fervor-pepper")]


def test_with_a_real_robot_that_vanishes_and_returns(live: Live, sample: list[tuple[float, Any]]) -> None:
    need_qi()
    from fervor_pepper.qi_robot import Pepper

    with (
        QiRobot() as robot,
        Pepper(robot.url) as pepper,
        sync.connect(live.stream) as session,
        Companion(pepper, session, behaviour=behaviour(timing=HASTY)) as companion,
    ):
        assert pepper.wait(30)
        weak = [number for number, (t, _) in enumerate(sample) if t < 4.0]
        strong = [number for number, (t, _) in enumerate(sample) if 4.0 <= t < 20.0]
        feed(companion, [sample[number] for number in weak], emotion="joy")
        assert [call[1] for call in robot.calls_until("said")] == ["setLanguage", "say", "said"]
        robot.kill()
        feed(companion, [sample[number] for number in strong], emotion="joy")
        assert session.reconnects == 0  # the estimates never noticed
        robot.start()
        assert pepper.wait(60)
        # What is still shown is answered now: a tick of the companion or the next estimate does it.
        t, pose = sample[strong[-1] + 1]
        companion.feed(pose, t=t)
        assert [call for call in robot.calls_until("ran") if call[0] == "ALAnimationPlayer"] == [
            ["ALAnimationPlayer", "run", HAPPY],
            ["ALAnimationPlayer", "ran", HAPPY],
        ]
