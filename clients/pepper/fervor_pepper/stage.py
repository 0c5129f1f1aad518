"""Where acts happen: one thread that has the robot do them, one after the other, and tells how each ended."""

import logging
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from fervor_pepper.acts import Act, pick_gesture
from fervor_pepper.robot import Robot, RobotAway, RobotError

logger = logging.getLogger("fervor_pepper")


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an act ended."""

    act: Act
    gesture: str | None = None
    """The one that was played."""
    error: RobotError | None = None
    """Why it went wrong."""

    @property
    def reached(self) -> bool:
        """Whether the robot was there at all."""
        return not isinstance(self.error, RobotAway)


class Stage:
    """Has a robot act. An act that comes while another hangs fails at once, so that none is done late."""

    def __init__(self, robot: Robot, tell: Callable[[Outcome], None]) -> None:
        """`tell`: called with the outcome of every act, from any thread."""
        self._robot = robot
        self._tell = tell
        self._busy = threading.Lock()
        self._acts: queue.SimpleQueue[Act | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="fervor-pepper-stage", daemon=True)

    def open(self) -> None:
        """Be ready for acts."""
        self._thread.start()

    def start(self, act: Act) -> None:
        """Begin an act; its outcome is told later."""
        if not self._busy.acquire(blocking=False):
            self._tell(Outcome(act, error=RobotAway("the robot still hangs in what it was told before")))
            return
        self._acts.put(act)

    def stop(self) -> None:
        """End the act that is under way."""
        self._robot.stop()

    def close(self, seconds: float) -> None:
        """No more acts come; wait until the last has ended, so long at most."""
        self._acts.put(None)
        self._thread.join(seconds)

    def _run(self) -> None:
        while (act := self._acts.get()) is not None:
            outcome = self._perform(act)
            self._busy.release()
            self._tell(outcome)

    def _perform(self, act: Act) -> Outcome:
        try:
            gestures = pick_gesture(act.gestures, self._robot.animations()) if act.gestures else ()
            if act.gestures and not gestures and act.say is None:
                return Outcome(act, error=RobotError(_has_none(act)))
            return Outcome(act, self._robot.perform(replace(act, gestures=gestures)))
        except RobotError as error:
            return Outcome(act, error=error)
        except Exception as error:  # somebody's robot: its faults are told, and the show goes on
            logger.exception("the robot failed in act %d", act.number)
            return Outcome(act, error=RobotError(f"the robot failed: {type(error).__name__}: {error}"))


def _has_none(act: Act) -> str:
    return f"the robot has no gesture for {act.level} {act.emotion}; expected one of {', '.join(act.gestures)}"
