"""A robot that answers to what people's bodies show: the two modes of the paper, over qi or any other way.

    from fervor_client import sync
    from fervor_pepper import Companion, DryRobot

    with sync.connect("ws://127.0.0.1:8080") as session, Companion(DryRobot(), session) as companion:
        companion.feed([[0, 0, 0, 1]] * 13, emotion="joy")

`Pepper`, the robot over qi, is in `fervor_pepper.qi_robot`, the only module that needs qi. `Performer` is the core:
no robot, no clock, no socket.
"""

from fervor_pepper.acts import Act, Command, Stop, Voice
from fervor_pepper.behaviour import Behaviour, Mode
from fervor_pepper.behaviour_file import BehaviourError, default_behaviour, read_behaviour
from fervor_pepper.companion import Companion
from fervor_pepper.dry_robot import DryRobot
from fervor_pepper.performer import Performer
from fervor_pepper.robot import Robot, RobotAway, RobotError
from fervor_pepper.session_log import SessionLog

__all__ = [
    "Act",
    "Behaviour",
    "BehaviourError",
    "Command",
    "Companion",
    "DryRobot",
    "Mode",
    "Performer",
    "Robot",
    "RobotAway",
    "RobotError",
    "SessionLog",
    "Stop",
    "Voice",
    "default_behaviour",
    "read_behaviour",
]
