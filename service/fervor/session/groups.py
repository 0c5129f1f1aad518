"""Answers to `frames` messages, gathered until each message's last one is there."""

from dataclasses import dataclass, field

from fervor.protocol.messages import Estimate


@dataclass(slots=True)
class _Group:
    waiting: int = 1  # one for the message itself, so that it can't end before all its frames are known
    estimates: dict[int, Estimate] = field(default_factory=dict)  # position in the message → answer


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

    def put(self, group: int, place: int, estimate: Estimate) -> None:
        """An answer to the frame at `place`."""
        self._groups[group].estimates[place] = estimate

    def close(self, group: int) -> tuple[Estimate, ...] | None:
        """One wait less; all answers in the order of their frames if it was the last, else None."""
        gathered = self._groups[group]
        gathered.waiting -= 1
        if gathered.waiting:
            return None
        del self._groups[group]
        return tuple(gathered.estimates[place] for place in sorted(gathered.estimates))
