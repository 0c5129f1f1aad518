"""The program `fervor_node`: tells what can't be in one sentence with an exit code (sysexits.h)."""

import logging
import sys

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException

from fervor.errors import FervorError, InputError
from fervor_ros.node import FervorNode


def main() -> None:
    """Run the node until it is told to stop."""
    rclpy.init()
    try:
        _run()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except FervorError as error:
        _give_up(error.message, error.exit_code)
    except (ParameterException, NameValidationException) as error:
        _give_up(" ".join(str(error).split()), InputError.exit_code)
    finally:
        rclpy.try_shutdown()


def _run() -> None:
    node = FervorNode()
    for name in ("fervor_ros", "fervor_client"):
        logging.getLogger(name).addHandler(_ToRos(node))
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()


def _give_up(sentence: str, exit_code: int) -> None:
    sys.stderr.write(f"fervor_node: {sentence}\n")
    sys.exit(exit_code)


class _ToRos(logging.Handler):
    """Tells the log of ROS what the line to the service has to tell, from whatever thread."""

    def __init__(self, node: FervorNode) -> None:
        super().__init__(logging.WARNING)
        self._node = node

    def emit(self, record: logging.LogRecord) -> None:
        self._node.get_logger().warning(record.getMessage())
