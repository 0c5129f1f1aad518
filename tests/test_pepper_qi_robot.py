"""Pepper against real qi services in another process: what it is told, what is missing, and a robot that vanishes."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from fervor.errors import InputError
from fervor.levels import Level
from fervor_pepper.acts import Act, Voice
from fervor_pepper.robot import RobotAway, RobotError
from robots import HAPPY, QiRobot, need_qi

need_qi()

from fervor_pepper.qi_robot import EVENT, Pepper  # noqa: E402  # needs qi

ENGLISH = Voice("en", "English")


def act(**fields: Any) -> Act:
    return Act(1, **({"voice": ENGLISH} | fields))


@contextmanager
def failing(pepper: Pepper, what: Act) -> Iterator[list[RobotError]]:
    """Perform an act in a thread, as the stage does; how it failed, once the block is left."""
    failures: list[RobotError] = []

    def perform() -> None:
        try:
            pepper.perform(what)
        except RobotError as error:
            failures.append(error)

    thread = threading.Thread(target=perform)
    thread.start()
    yield failures
    thread.join(30)
    assert len(failures) == 1


@pytest.fixture
def robot() -> Iterator[QiRobot]:
    with QiRobot(animations=(HAPPY, "animations/Stand/Gestures/Hey_1")) as started:
        yield started


@pytest.fixture
def pepper(robot: QiRobot) -> Iterator[Pepper]:
    with Pepper(robot.url) as connected:
        assert connected.wait(30)
        yield connected


def test_it_speaks_in_its_language_and_tells_other_programs(robot: QiRobot, pepper: Pepper) -> None:
    joyful = act(say="you look so happy!", emotion="joy", level=Level.WEAK)
    assert pepper.perform(joyful) is None
    assert list(robot.calls_until("raiseEvent")) == [
        ["ALTextToSpeech", "setLanguage", "English"],
        ["ALTextToSpeech", "say", "you look so happy!"],
        ["ALTextToSpeech", "said", "you look so happy!"],
        ["ALMemory", "raiseEvent", EVENT, ["joy", "weak", "you look so happy!", ""]],
    ]
    pepper.perform(act(say="hmm"))
    pepper.perform(act(say="ach so", voice=Voice("de", "German")))
    told = [call[1:] for call in robot.calls_until("raiseEvent")] + [c[1:] for c in robot.calls_until("raiseEvent")]
    assert [call for call in told if call[0] in ("say", "setLanguage")] == [
        ["say", "hmm"],
        ["setLanguage", "German"],
        ["say", "ach so"],
    ]


def test_it_knows_what_it_can_play_and_plays_it(robot: QiRobot, pepper: Pepper) -> None:
    assert pepper.animations() == {HAPPY, "animations/Stand/Gestures/Hey_1"}
    assert pepper.perform(act(gestures=(HAPPY,), leds=0xFFCC00)) == HAPPY
    told = list(robot.calls_until("raiseEvent"))
    assert [call for call in told if call[0] == "ALAnimationPlayer"] == [
        ["ALAnimationPlayer", "run", HAPPY],
        ["ALAnimationPlayer", "ran", HAPPY],
    ]
    assert ["ALLeds", "fadeRGB", "FaceLeds", 0xFFCC00, pytest.approx(0.3)] in told
    assert ["ALLeds", "reset", "FaceLeds"] in told


def test_lights_alone_are_an_act(robot: QiRobot, pepper: Pepper) -> None:
    assert pepper.perform(act(leds=0xFF)) is None
    assert [call[1] for call in robot.calls_until("raiseEvent")] == ["fadeRGB", "reset", "raiseEvent"]


def test_speech_and_gesture_together_are_animated_speech(robot: QiRobot, pepper: Pepper) -> None:
    assert pepper.perform(act(say="hello!", gestures=(HAPPY,))) == HAPPY
    assert ["ALAnimatedSpeech", "say", f"^start({HAPPY}) hello! ^wait({HAPPY})"] in list(
        robot.calls_until("raiseEvent")
    )


def test_errors_are_one_sentence_and_the_next_act_works(robot: QiRobot, pepper: Pepper) -> None:
    with pytest.raises(RobotError, match=r"could not say 'unspeakable': .*no voice for this") as caught:
        pepper.perform(act(say="unspeakable"))
    assert "\n" not in caught.value.message
    assert not isinstance(caught.value, RobotAway)
    assert pepper.perform(act(say="fine")) is None


def test_a_language_that_is_not_installed_is_told_and_it_speaks_on(
    robot: QiRobot, pepper: Pepper, caplog: pytest.LogCaptureFixture
) -> None:
    pepper.perform(act(say="nuqneH", voice=Voice("tlh", "Klingon")))
    assert ["ALTextToSpeech", "say", "nuqneH"] in list(robot.calls_until("raiseEvent"))
    assert "could not speak Klingon" in caplog.text


def test_a_robot_with_two_services_and_few_methods_will_do() -> None:
    with (
        QiRobot(services=("ALTextToSpeech", "ALAnimationPlayer"), bare=True) as robot,
        Pepper(robot.url) as pepper,
    ):
        assert pepper.wait(30)
        assert pepper.animations() is None
        # It can't say what it has, so they are tried in turn.
        assert pepper.perform(act(say="both", gestures=("animations/none", HAPPY), leds=0xFF)) == HAPPY
        assert [call[:3] for call in robot.calls()] == [
            ["ALTextToSpeech", "say", "both"],
            ["ALTextToSpeech", "said", "both"],
            ["ALAnimationPlayer", "run", "animations/none"],
            ["ALAnimationPlayer", "run", HAPPY],
            ["ALAnimationPlayer", "ran", HAPPY],
        ]
        with pytest.raises(RobotError, match=r"could not play animations/none: .*does not exist"):
            pepper.perform(act(gestures=("animations/none",)))


def test_a_robot_that_can_do_nothing_says_so() -> None:
    with QiRobot(services=("ALMemory",)) as robot, Pepper(robot.url) as pepper:
        assert pepper.wait(30)
        with pytest.raises(RobotError, match="has no ALTextToSpeech"):
            pepper.perform(act(say="hello"))
        with pytest.raises(RobotError, match="has no ALAnimationPlayer"):
            pepper.perform(act(gestures=(HAPPY,)))


def test_stop_ends_what_is_under_way() -> None:
    with QiRobot(seconds=60.0) as robot, Pepper(robot.url) as pepper:
        assert pepper.wait(30)
        with failing(pepper, act(say="a long story")) as failures:
            list(robot.calls_until("say"))
            pepper.stop()
        assert "was stopped while it was to say 'a long story'" in failures[0].message
        assert [call[1] for call in robot.calls_until("said")] == ["stopAll", "said"]


def test_a_robot_that_vanishes_and_returns(caplog: pytest.LogCaptureFixture) -> None:
    with QiRobot(seconds=60.0) as robot, Pepper(robot.url) as pepper:
        assert pepper.wait(30)
        with failing(pepper, act(say="cut off")) as failures:
            list(robot.calls_until("say"))
            robot.kill()
        assert isinstance(failures[0], RobotAway)
        with pytest.raises(RobotAway, match="is out of reach"):
            pepper.perform(act(say="to nobody"))
        robot.start()
        assert pepper.wait(60)
        pepper.stop()  # nothing is under way, and nothing comes of it
        assert pepper.animations() == {HAPPY}
    assert [r.message.rpartition(" ")[2] for r in caplog.records if r.levelno == logging.WARNING] == ["again", "back"]


def test_a_robot_that_falls_silent_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor_pepper.qi_robot.ANSWER_S", 0.5)
    with QiRobot() as robot, Pepper(robot.url) as pepper:
        assert pepper.wait(30)
        robot.freeze()
        with pytest.raises(RobotAway, match="does not answer any more"):
            pepper.animations()
        robot.freeze(thaw=True)
        assert pepper.wait(60)
        assert pepper.animations() == {HAPPY}


def test_nobody_there_is_told_and_tried_again(caplog: pytest.LogCaptureFixture) -> None:
    robot = QiRobot()
    with Pepper(robot.url) as pepper:
        assert not pepper.wait(0.5)
        with pytest.raises(RobotAway):
            pepper.perform(act(say="hello"))
        with robot:
            assert pepper.wait(60)
            assert pepper.perform(act(say="hello")) is None
    assert f"no robot answers at {robot.url}: " in caplog.text


@pytest.mark.parametrize("url", ["pepper.local", "http://127.0.0.1:9559", "127.0.0.1:9559"])
def test_an_address_that_is_none(url: str) -> None:
    with pytest.raises(InputError, match=r"expected one like tcp://pepper\.local:9559"):
        Pepper(url)
