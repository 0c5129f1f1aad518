"""Pepper (and NAO) over qi: the one file that imports it.

Rules. A keeper thread connects, and connects again after a pause that doubles, for as long as the robot is used. The
end of a call is the end of what was said or played (NAOqi's blocking calls), so it is what `perform` waits for; where
none comes, `stop` ends the wait. Only ALTextToSpeech must be there, and ALAnimationPlayer for gestures; a service or
method that is missing is passed over.
"""

import logging
import threading
from collections.abc import Callable
from typing import Any, Self

import qi

from fervor.errors import InputError
from fervor_pepper.acts import Act
from fervor_pepper.robot import RobotAway, RobotError

logger = logging.getLogger("fervor_pepper")

FIRST_PAUSE_S = 0.5
LONGEST_PAUSE_S = 10.0

ANSWER_S = 5.0
"""Longest wait for an answer that takes no speaking and no moving."""

STOP_S = 2.0
"""How long a call may take to end once it was stopped; then the line is taken to be dead."""

EYES = "FaceLeds"
FADE_S = 0.3

EVENT = "Fervor/Act"
"""ALMemory event for other programs on the robot: [emotion, level, said, gesture]."""


class Pepper:
    """A robot that speaks qi. `close` it, or use it in a `with`."""

    def __init__(self, url: str) -> None:
        """Connect in the background to `url`, like `tcp://pepper.local:9559`.

        Raises:
            InputError: not such an address.
        """
        if not url.startswith(("tcp://", "tcps://")):
            raise InputError(f"{url!r} is not the address of a robot; expected one like tcp://pepper.local:9559")
        self.url = url
        self._session: Any = None
        self._closed = False
        self._change = threading.Condition()  # guards the two above
        self._voice: str | None = None
        self._wake = threading.Event()
        self._stopped = False
        self._keeper = threading.Thread(target=self._keep, name="fervor-pepper-keeper", daemon=True)
        self._keeper.start()

    def wait(self, seconds: float) -> bool:
        """Wait until the robot answers, so long at most; whether it does."""
        with self._change:
            return self._change.wait_for(lambda: self._session is not None, seconds)

    def animations(self) -> frozenset[str] | None:
        """What ALBehaviorManager has installed; None where there is none to ask."""
        manager = self._service("ALBehaviorManager")
        if not hasattr(manager, "getInstalledBehaviors"):
            return None
        return frozenset(map(str, self._call("the list of animations", manager.getInstalledBehaviors)))

    def perform(self, act: Act) -> str | None:
        """Speak, move, or both; see `Robot.perform`."""
        self._stopped = False
        self._light(act.leds)
        try:
            gesture = self._speak_and_move(act)
        finally:
            if act.leds is not None:
                self._aside("ALLeds", "reset", EYES)
        told = [str(word or "") for word in (act.emotion, act.level, act.say, gesture)]  # qi knows no StrEnum
        self._aside("ALMemory", "raiseEvent", EVENT, told)
        return gesture

    def stop(self) -> None:
        """End what is under way."""
        self._stopped = True
        self._wake.set()

    def close(self) -> None:
        """Let go of the robot."""
        with self._change:
            self._closed = True
            self._change.notify_all()
        self._keeper.join(2 * ANSWER_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    # --- what it does ---------------------------------------------------------------------------------------------

    def _speak_and_move(self, act: Act) -> str | None:
        if not act.gestures:
            if act.say:
                self._speak(act)
            return None
        animated = self._service("ALAnimatedSpeech") if act.say else None
        if animated is not None:
            self._set_voice(act)
            gesture = act.gestures[0]
            self._perform(f"say {act.say!r}", animated.say, f"^start({gesture}) {act.say} ^wait({gesture})")
            return gesture
        if act.say:
            self._speak(act)
        return self._move(act.gestures)

    def _speak(self, act: Act) -> None:
        speech = self._needed("ALTextToSpeech")
        self._set_voice(act)
        self._perform(f"say {act.say!r}", speech.say, act.say)

    def _move(self, gestures: tuple[str, ...]) -> str:
        """Play the first gesture that the robot knows."""
        player = self._needed("ALAnimationPlayer")
        for gesture in gestures[:-1]:
            try:
                self._perform(f"play {gesture}", player.run, gesture)
            except RobotAway:
                raise
            except RobotError as error:
                logger.debug("%s", error)
                if self._stopped:
                    raise
            else:
                return gesture
        self._perform(f"play {gestures[-1]}", player.run, gestures[-1])
        return gestures[-1]

    def _set_voice(self, act: Act) -> None:
        """Speak the act's language from now on; told once if the robot has it not."""
        if act.voice.name == self._voice:
            return
        self._voice = act.voice.name
        speech = self._service("ALTextToSpeech")
        if hasattr(speech, "setLanguage"):
            try:
                self._call(f"speak {act.voice.name}", speech.setLanguage, act.voice.name)
            except RobotAway:
                raise
            except RobotError as error:
                logger.warning("%s; it speaks on in its own language", error)

    def _light(self, colour: int | None) -> None:
        if colour is not None:
            self._aside("ALLeds", "fadeRGB", EYES, colour, FADE_S)

    def _aside(self, service: str, method: str, *arguments: object) -> None:
        """Call what is not the act itself: nobody waits for it, and it may be missing."""
        try:
            found = self._service(service)
            if hasattr(found, method):
                self._send(method, getattr(found, method), *arguments).addCallback(_told_if_failed)
        except RobotError as error:
            logger.debug("%s.%s: %s", service, method, error)

    # --- calls ----------------------------------------------------------------------------------------------------

    def _service(self, name: str) -> Any:
        """A service of the robot; None if it has none of that name."""
        session = self._connected()
        try:
            return self._call(name, session.service, name)
        except RobotAway:
            raise
        except RobotError:
            return None

    def _needed(self, name: str) -> Any:
        found = self._service(name)
        if found is None:
            raise RobotError(f"the robot at {self.url} has no {name}")
        return found

    def _connected(self) -> Any:
        with self._change:
            session = self._session
        if session is None or not session.isConnected():
            raise RobotAway(f"the robot at {self.url} is out of reach")
        return session

    def _call(self, what: str, method: Callable[..., Any], *arguments: object) -> Any:
        """Call a method that answers at once."""
        future = self._send(what, method, *arguments)
        future.wait(round(ANSWER_S * 1000))
        return self._result(what, future)

    def _perform(self, what: str, method: Callable[..., Any], *arguments: object) -> None:
        """Call a method that speaks or moves, and wait until it is done or stopped."""
        over = self._wake = threading.Event()  # before the look at `_stopped`, so that no stop is missed
        if self._stopped:
            raise RobotError(f"the robot at {self.url} was stopped before it could {what}")
        future = self._send(what, method, *arguments)
        future.addCallback(lambda _: over.set())
        over.wait()
        if self._stopped and not future.isFinished():
            self._aside("ALTextToSpeech", "stopAll")
            self._aside("ALAnimationPlayer", "stopAll")
            future.wait(round(STOP_S * 1000))
            self._result(what, future)
            raise RobotError(f"the robot at {self.url} was stopped while it was to {what}")
        self._result(what, future)

    def _send(self, what: str, method: Callable[..., Any], *arguments: object) -> Any:
        try:
            return method(*arguments, _async=True)
        except RuntimeError as error:
            raise self._failure(what, str(error)) from None

    def _result(self, what: str, future: Any) -> Any:
        if not future.isFinished():
            self._hang_up()
            raise RobotAway(f"the robot at {self.url} does not answer any more: it was told to {what}")
        if future.hasError():
            raise self._failure(what, future.error())
        return future.value()

    def _failure(self, what: str, said: str) -> RobotError:
        said = " ".join(said.split()) or "no reason given"
        session = self._session
        if session is None or not session.isConnected():
            return RobotAway(f"the robot at {self.url} went away when it was told to {what}: {said}")
        return RobotError(f"the robot at {self.url} could not {what}: {said}")

    # --- connections ----------------------------------------------------------------------------------------------

    def _keep(self) -> None:
        """Hold a connection until closed."""
        pause, told = FIRST_PAUSE_S, False
        while not self._closed:
            failure = self._connect()
            if failure is None:
                if told:
                    logger.warning("the robot at %s is back", self.url)
                pause, told = FIRST_PAUSE_S, True
                self._wait_until_lost()
                if not self._closed:
                    logger.warning("the robot at %s went away; trying to reach it again", self.url)
                continue
            if not told:
                logger.warning("no robot answers at %s: %s; trying again until it does", self.url, failure)
            told = True
            with self._change:
                self._change.wait_for(lambda: self._closed, pause)
            pause = min(2 * pause, LONGEST_PAUSE_S)

    def _connect(self) -> str | None:
        """Connect; why not, if not."""
        session = qi.Session()
        future = session.connect(self.url, _async=True)
        future.wait(round(ANSWER_S * 1000))
        if not future.isFinished():
            future.cancel()
            return "no answer in time"
        if future.hasError():
            return " ".join(str(future.error()).split())
        session.disconnected.connect(self._told_of_the_end)
        with self._change:
            self._session, self._voice = session, None
            self._change.notify_all()
        return None

    def _wait_until_lost(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._session is None or not self._session.isConnected())
            session, self._session = self._session, None
        if session is not None:
            session.close()
        self._wake.set()

    def _told_of_the_end(self, *_: object) -> None:
        with self._change:
            self._change.notify_all()

    def _hang_up(self) -> None:
        with self._change:
            session, self._session = self._session, None
            self._change.notify_all()
        if session is not None:
            session.close(_async=True)


def _told_if_failed(future: Any) -> None:
    if future.hasError():
        logger.debug("%s", future.error())
