"""Answers to `frames` messages, gathered until each message's last one is there."""

from dataclasses import dataclass, field

from fervor.protocol.lean_estimate import LeanEstimate
from fervor.protocol.messages import Checkpoint, SessionCalibrated

Follower = Checkpoint | SessionCalibrated
"""What the client may build on only once it has the answers to all frames before."""


@dataclass(slots=True)
class _Group:
    waiting: int = 1  # one for the message itself, so that it can't end before all its frames are known
    estimates: dict[int, LeanEstimate] = field(default_factory=dict)  # position in the message → answer
    followers: dict[str, Follower] = field(default_factory=dict)  # by body, "" for the session


@dataclass(frozen=True, slots=True)
class Gathered:
    """All answers to one message, in the order of its frames, and what follows them."""

    estimates: tuple[LeanEstimate, ...]
    followers: tuple[Follower, ...]
    """Checkpoints or, in one message with all of them, a calibration."""


class Groups:
    """The messages that wait for answers."""

    def __init__(self) -> None:
        self._groups: dict[int, _Group] = {}
        self._last = 0

    def open(self) -> int:
        """A new message; `close` it once all its frames are planned."""
        self._last += 1
        self._groups[self._last] = _Group()
        return self._last

    def expect(self, group: int) -> None:
        """One of its frames is under way."""
        self._groups[group].waiting += 1

    def put(self, group: int, place: int, estimate: LeanEstimate) -> None:
        """An answer to the frame at `place`."""
        self._groups[group].estimates[place] = estimate

    def follow(self, group: int, message: Follower) -> None:
        """Say this after the answers; of a body's checkpoints, the newest only."""
        followers, body = self._groups[group].followers, message.body if isinstance(message, Checkpoint) else ""
        followers.pop(body, None)  # so that the newest comes last
        followers[body] = message

    def close(self, group: int) -> Gathered | None:
        """One wait less; all that was gathered if it was the last, else None."""
        gathered = self._groups[group]
        gathered.waiting -= 1
        if gathered.waiting:
            return None
        del self._groups[group]
        estimates = tuple(gathered.estimates[place] for place in sorted(gathered.estimates))
        return Gathered(estimates, _together(gathered.followers))


def _together(followers: dict[str, Follower]) -> tuple[Follower, ...]:
    """A calibration voids all checkpoints before it, so it brings the new ones: no loss can come between them."""
    checkpoints = tuple(message for message in followers.values() if isinstance(message, Checkpoint))
    calibrated = followers.get("")
    return checkpoints if calibrated is None else (calibrated.model_copy(update={"checkpoints": checkpoints}),)
