"""How the node fares, in the words of `diagnostic_msgs`."""

from dataclasses import dataclass
from enum import IntEnum

from fervor_ros.uplink import Line


class Severity(IntEnum):
    """Values of `diagnostic_msgs/DiagnosticStatus.level`."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Health:
    """One status."""

    severity: Severity
    message: str
    values: tuple[tuple[str, str], ...]


def health(line: Line, *, service: str, silent: frozenset[str], bodies: int) -> Health:
    """The status of the node.

    Args:
        line: how the line to the service fares.
        service: its address.
        silent: bodies that are tracked and send no poses.
        bodies: how many are tracked.
    """
    values: dict[str, object] = {"service": service}
    if line.model is not None:
        values |= {"model": f"{line.model.name} {line.model.version}", "purpose": line.model.purpose}
    values |= {
        "bodies": bodies,
        "frames sent": line.sent,
        "estimates": line.answered,
        "frames refused": line.refused,
        "frames dropped": line.dropped,
        "sessions": line.sessions,
        "reconnects": line.reconnects,
    }
    severity, message = _verdict(line, silent)
    return Health(severity, message, tuple((name, str(value)) for name, value in values.items()))


def _verdict(line: Line, silent: frozenset[str]) -> tuple[Severity, str]:
    if not line.connected:
        severity = Severity.WARN if line.sessions else Severity.ERROR
        return severity, line.trouble or "connecting"
    if silent:
        return Severity.WARN, f"no poses come of {', '.join(sorted(silent))}"
    demo = line.model is not None and line.model.purpose == "demo"
    return Severity.OK, "streaming to a demo model" if demo else "streaming"
