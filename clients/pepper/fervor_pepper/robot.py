"""What a robot must be able to do. Three methods; another robot than Pepper implements them in twenty lines.

Example: docs/how-to/drive-pepper.md.
"""

from typing import Protocol

from fervor.errors import FervorError, Unreachable
from fervor_pepper.acts import Act


class RobotError(FervorError):
    """A robot could not do what it was told; the show goes on."""

    code = "robot_failed"
    exit_code = 69


class RobotAway(Unreachable, RobotError):
    """No robot answers at the address, or it went away; the act never reached it."""

    code = "robot_away"


class Robot(Protocol):
    """A robot that can speak and move. `perform` is called from one thread, the others from any."""

    def animations(self) -> frozenset[str] | None:
        """Names of all gestures it has; None where it can't say.

        Raises:
            RobotError: it can't be asked.
        """

    def perform(self, act: Act) -> str | None:
        """Do it, and return when it is done: speak `act.say`, play the first of `act.gestures` that is there.

        Returns:
            The gesture that was played; None if there was none to play.

        Raises:
            RobotAway: the robot is out of reach; the act is owed again.
            RobotError: it went wrong, in one sentence.
        """

    def stop(self) -> None:
        """End what is under way, so that `perform` returns soon; wait for nothing, raise nothing."""
