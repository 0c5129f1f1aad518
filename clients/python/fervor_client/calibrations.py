"""Calibrations that were asked for: which of them is still to be answered, and which one an answer belongs to.

Rules. A service has one under way; another takes its place, unless the frames sent between the two have decided it by
then · answers name no request, but come in order: that of one is told before any estimate of a frame that was sent
after the next one · those that wait for an answer are asked again after a cut, in their places, for the frames between
them decide the same again.
"""

from dataclasses import dataclass, field
from math import inf

from fervor.errors import FervorError, InputError
from fervor.protocol.messages import SessionCalibrate, SessionCalibrated
from fervor_client.answers import Key
from fervor_client.track import Entry


@dataclass(slots=True, eq=False)
class _Asked:
    """One that waits for its answer, or that one before it may have been replaced by."""

    number: int
    request: SessionCalibrate
    entry: Entry
    first: float = inf  # seconds, of the frames of its body since
    last: float = -inf
    gone: bool = False
    """Its body was gone after it had begun."""
    since: set[Key] = field(default_factory=set)
    """Frames of all bodies since, before the next one was asked for; kept while others wait before it."""
    replaced: bool = False
    """By the next one. It is asked again while others wait before it, for it took the place of those."""

    def decided(self, *, timed: bool) -> bool:
        """Whether the frames so far may be enough, if the service takes all of them.

        Under clock `frames` times are the service's: any frame may do.
        """
        return self.gone or (self.last - self.first >= self.request.seconds if timed else self.last > -inf)


class Calibrations:
    """Those of one conversation."""

    def __init__(self, *, timed: bool) -> None:
        """`timed`: frames have times of the client's, as under clock `time`."""
        self._timed = timed
        self._number = 0
        self._asked: list[_Asked] = []
        self._found: dict[int, SessionCalibrated | FervorError] = {}

    @property
    def entries(self) -> list[Entry]:
        """What to ask again after a cut."""
        return [asked.entry for asked in self._asked]

    @property
    def decided(self) -> bool:
        """Whether an answer may be on its way."""
        return any(asked.decided(timed=self._timed) for asked in self._waiting)

    def holds(self, body: str) -> bool:
        """Whether an answer may rest on frames of this body."""
        return any(asked.request.body == body for asked in self._waiting)

    def ask(self, request: SessionCalibrate, entry: Entry) -> int:
        """One is asked for; the number to take its answer by."""
        if self._asked and not self._asked[-1].decided(timed=self._timed):
            self._replace(self._asked[-1])
        self._number += 1
        self._asked.append(_Asked(self._number, request, entry))
        self._forget()
        return self._number

    def sent(self, key: Key, time: float) -> None:
        """A frame is under way; `time` in seconds."""
        if self._asked:
            newest = self._asked[-1]
            if len(self._asked) > 1:
                newest.since.add(key)
            if key[0] == newest.request.body:
                newest.first, newest.last = min(newest.first, time), max(newest.last, time)

    def gone(self, body: str) -> None:
        """A body is gone, and with it the pose that it held."""
        if self._asked and (newest := self._asked[-1]).request.body == body:
            newest.gone = newest.gone or newest.last > -inf

    def estimated(self, key: Key) -> None:
        """A frame has its estimate: of those before the newest one at its time no answer comes any more."""
        place = next((place for place, asked in enumerate(self._asked) if key in asked.since), 0)
        for asked in self._asked[:place]:
            self._replace(asked)
        self._forget()

    def calibrated(self, message: SessionCalibrated) -> None:
        """The oldest has its answer."""
        if self._asked:
            self._found[self._asked.pop(0).number] = message.model_copy(update={"checkpoints": ()})
            self._forget()

    def failed(self, body: str | None, error: InputError) -> bool:
        """One whose pose `body` held came to nothing, or the newest, which could not begin; whether there was one."""
        waiting = self._waiting
        named = [asked for asked in waiting if asked.request.body == body] or waiting[-1:]
        if named:
            self._asked.remove(named[0])
            self._found[named[0].number] = error
            self._forget()
        return bool(named)

    def take(self, number: int) -> SessionCalibrated | None:
        """The answer to one, once; None while it is under way. Raises the error that it failed with."""
        found = self._found.pop(number, None)
        if isinstance(found, FervorError):
            raise found
        return found

    @property
    def _waiting(self) -> list[_Asked]:
        return [asked for asked in self._asked if not asked.replaced]

    def _replace(self, asked: _Asked) -> None:
        if not asked.replaced:
            asked.replaced = True
            self._found[asked.number] = InputError("another calibration took the place of this one")

    def _forget(self) -> None:
        """Those that were replaced, unless others wait before them."""
        while self._asked and self._asked[0].replaced:
            self._asked.pop(0)
