"""One body as the replay log knows it: its newest checkpoint, and every message sent since."""

from collections import deque
from dataclasses import dataclass, field
from math import inf

from fervor.emotions import UNKNOWN
from fervor.protocol.messages import Emotion

ANALYSER_TTL_S = 2.0
"""Seconds that a service holds probabilities for, unless told otherwise."""

Payload = str | bytes


@dataclass(slots=True, eq=False)
class Entry:
    """A message that was sent."""

    place: int
    """In the order sent."""
    payload: Payload
    seq: int | None = None
    """Where it is a frame."""
    answered: bool = False
    label: tuple[Emotion, float] | None = None
    """The label it brought, and its time in seconds."""
    begins: bool = False
    """A frame after so long that the service had forgotten the body."""
    ends: bool = False
    """The body is gone with it."""


@dataclass(slots=True, eq=False)
class Track:
    """One body."""

    entries: deque[Entry] = field(default_factory=deque)
    """Since the checkpoint or, without one, since the body came."""
    token: str = ""
    seq: int = -1
    """Newest frame that the checkpoint covers; without one, that the entries follow, where there is one."""
    since: float = 0.0  # seconds, when the checkpoint came
    whole: bool = True
    """Checkpoint and entries are all there is to know; else entries are missing between the two."""
    here: bool = False
    """The service follows it."""
    newest: int = -1
    last: float = -inf  # seconds, newest frame
    endings: int = 0
    """Entries that end a life."""
    label: tuple[Emotion, float] | None = None
    """The label that answered frames left in force."""
    unlabelled: bool = False
    """The service lost that label."""

    @property
    def untouched(self) -> bool:
        """Whether nothing of it was answered: all of it is still to come."""
        return self.whole and not self.token and not any(entry.answered for entry in self.entries)

    def label_at(self, time: float, ttl_s: float | None) -> Emotion | None:
        """The label in force at `time`, before any frame under way; None: the one that new bodies have."""
        if self.label is None:
            return None
        emotion, given = self.label
        held = ttl_s or (inf if isinstance(emotion, str) else ANALYSER_TTL_S)
        return emotion if time <= given + held else UNKNOWN

    def answered(self, entry: Entry) -> None:
        """A frame has its estimate."""
        entry.answered = True
        self.label = entry.label or (None if entry.begins else self.label)
        if not self.whole:
            self._drop_before(entry)

    def refused(self, entry: Entry, *, forget: bool) -> None:
        """A frame was refused; `forget` it where it left no trace."""
        entry.answered = True
        if forget and entry in self.entries:
            self.entries.remove(entry)

    def remind_again(self) -> None:
        """The frame that brought the label again may have been refused: the next one is to, if none did since."""
        self.unlabelled = self.label is not None and not any(entry.label for entry in self.entries)

    def drop_through(self, entry: Entry) -> None:
        """A checkpoint covers all up to this entry."""
        while self._drop_first() is not entry:
            pass

    def give_up(self) -> None:
        """This body can't be resumed until its next checkpoint: only what that one may not cover is kept."""
        self.token, self.whole = "", False
        newest = next((entry for entry in reversed(self.entries) if entry.answered), None)
        if newest is not None:
            self._drop_before(newest)

    def begin_anew(self) -> None:
        """The service knows nothing of this body: begin with its first frame, if incomplete with an unanswered one."""
        while self.entries and ((first := self.entries[0]).seq is None or (first.answered and not self.whole)):
            self._drop_first()
        self.seq, self.whole = -1, True
        self.here = self.here and bool(self.entries) and not self.entries[-1].ends
        self.unlabelled = not self.entries and self.label is not None

    def end(self, entry: Entry) -> None:
        """The body is gone with this entry, which is its last."""
        entry.ends = True
        self.here, self.newest, self.last = False, -1, -inf
        self.endings += 1

    def bury(self) -> bool:
        """Drop the lives of this body that have ended and whose frames are all answered; whether there was one."""
        buried = False
        while self.endings:
            life = next(n for n, entry in enumerate(self.entries, 1) if entry.ends)
            if any(entry.seq is not None and not entry.answered for entry in list(self.entries)[:life]):
                break
            for _ in range(life):
                self._drop_first()
            self.token, self.seq, self.whole, buried = "", -1, True, True
        return buried

    def forget(self) -> None:
        """The life that the service lost has ended: the next one has nothing of it."""
        self.label, self.unlabelled, self.newest, self.last = None, False, -1, -inf

    def _drop_first(self) -> Entry:
        """Drop the oldest entry; where a life ends with it, only labels that were given since are in force."""
        first = self.entries.popleft()
        if first.ends:
            self.endings -= 1
            self.label = next((entry.label for entry in reversed(self.entries) if entry.answered and entry.label), None)
        return first

    def _drop_before(self, entry: Entry) -> None:
        """Drop what stands before an answered entry, except frames under way."""
        while self.entries and (first := self.entries[0]) is not entry and (first.answered or first.seq is None):
            self._drop_first()
            self.seq = -1
