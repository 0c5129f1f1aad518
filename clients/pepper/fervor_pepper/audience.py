"""The people before the robot: what each shows, and whom it attends to.

Rules. What a person shows is an emotion and a level. It counts once it was shown for `settle_s` by estimates to be
trusted (status `ok`); each change of it is owed one answer. An estimate that is not to be trusted changes nothing but
begins the settling anew. Who was reset, or is unseen for `lost_s`, is new. The robot stays with a person for `hold_s`,
then turns to whoever the behaviour prefers; with one who shows nothing it does not stay.
"""

from dataclasses import dataclass

from fervor.emotions import UNKNOWN
from fervor.levels import Level
from fervor.protocol.messages import Estimate
from fervor_pepper.behaviour import Attention

ANEW = frozenset({"gap_reset", "clock_reset", "reset"})
"""Flags of an estimate whose body begins anew."""

PASSED_OVER = frozenset({"late", "duplicate"})
"""Flags of an estimate that says nothing new."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What a person shows."""

    emotion: str
    level: Level


@dataclass(slots=True)
class Person:
    """One body, as far as the robot minds it. Times are seconds."""

    body: str
    since: float
    seen: float
    intensity: float = 0.0
    trusted: bool = False
    """Whether the newest estimate is to be trusted."""
    shown: Shown | None = None
    owed: bool = False
    """Whether what is shown has not been answered."""
    settling: Shown | None = None
    settling_since: float | None = None

    def take(self, estimate: Estimate, now: float, settle_s: float) -> None:
        """Take in the newest estimate."""
        if ANEW & set(estimate.flags):
            self.shown, self.owed, self.settling_since = None, False, None
        self.trusted = estimate.status == "ok" and estimate.level is not None
        self.intensity = (estimate.intensity or 0.0) if self.trusted else 0.0
        if not self.trusted:
            self.settling_since = None
            return
        assert estimate.level is not None
        shown = None if estimate.emotion == UNKNOWN else Shown(estimate.emotion, estimate.level)
        if self.settling_since is None or shown != self.settling:
            self.settling, self.settling_since = shown, now
        if now - self.settling_since >= settle_s and shown != self.shown:
            self.shown, self.owed = shown, shown is not None


class Audience:
    """Everybody in sight."""

    def __init__(self, attention: Attention, settle_s: float) -> None:
        self._attention = attention
        self._settle_s = settle_s
        self._people: dict[str, Person] = {}
        self._attended: Person | None = None
        self._attended_since = 0.0

    def perceive(self, estimate: Estimate, now: float) -> None:
        """Take in an estimate that came at `now`, seconds."""
        flags = set(estimate.flags)
        if flags & PASSED_OVER:
            return
        self.forget_lost(now)
        person = self._people.get(estimate.body)
        if person is None:
            if "lost" in flags:
                return
            person = self._people[estimate.body] = Person(estimate.body, now, now)
        if "lost" not in flags:
            person.seen = now
        person.take(estimate, now, self._settle_s)

    def leave(self, body: str) -> None:
        """A person is gone."""
        person = self._people.pop(body, None)
        if person is self._attended:
            self._attended = None

    def forget_lost(self, now: float) -> None:
        """Those unseen for too long are gone."""
        for person in [person for person in self._people.values() if now - person.seen >= self._attention.lost_s]:
            self.leave(person.body)

    def attended(self, now: float) -> Person | None:
        """Whom the robot attends to; None if nobody is there."""
        self.forget_lost(now)
        held = self._attended is not None and now - self._attended_since < self._attention.hold_s
        if not held or self._attended is None or self._attended.shown is None:
            chosen = max(self._people.values(), key=self._rank, default=None)
            if chosen is not self._attended:
                self._attended, self._attended_since = chosen, now
        return self._attended

    def owe_again(self, body: str, shown: Shown) -> None:
        """An answer never reached this person; it is still owed if the same is still shown."""
        person = self._people.get(body)
        if person is not None and person.shown == shown:
            person.owed = True

    def _rank(self, person: Person) -> tuple[float, float]:
        """Greatest for whom the behaviour prefers; of equals, who came first."""
        if self._attention.to == "longest":
            return (float(person.shown is not None), -person.since)
        return (person.intensity if person.shown is not None else -1.0, -person.since)
