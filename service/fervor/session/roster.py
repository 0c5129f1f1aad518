"""The bodies of a session: who is there, who was forgotten, and whose slot the next one takes.

A slot that a body leaves goes to the session's next new body or, by a `Release` in order, back to the engine.
"""

from collections.abc import Callable, Iterator

from fervor.errors import FrameError, InputError
from fervor.session.body import Body, Terms
from fervor.session.events import Release
from fervor.session.label import Label


class Roster:
    """Bodies by the client's names for them."""

    def __init__(self, claim: Callable[[], int], *, most: int, idle_s: float) -> None:
        """An empty roster.

        Args:
            claim: takes a free slot of the engine; raises Overloaded.
            most: bodies at once.
            idle_s: seconds without a frame, client clock, after which a body is forgotten; infinite for never.
        """
        self._claim = claim
        self._most = most
        self._idle_s = idle_s
        self._bodies: dict[str, Body] = {}
        self.spare: list[int] = []
        """Slots of bodies that were forgotten, which nobody took over yet."""

    def __iter__(self) -> Iterator[Body]:
        return iter(self._bodies.values())

    def __contains__(self, name: object) -> bool:
        return name in self._bodies

    def find(self, name: str, time: float) -> Body | None:
        """The body called `name`, if it is there and at `time` (seconds, client clock) not to be forgotten."""
        body = self._bodies.get(name)
        return None if body is None or self._is_idle(body, time) else body

    def known(self, name: str) -> Body:
        """The body called `name`.

        Raises:
            FrameError: it is not there.
        """
        body = self._bodies.get(name)
        if body is None:
            raise FrameError(f"body {name!r} is not known in this session; it has sent no frame yet", body=name)
        return body

    def seen(self, name: str, time: float, terms: Terms, label: Callable[[], Label]) -> Body:
        """The body called `name` at `time` (seconds, client clock): as known, or a new one with a first label.

        Raises:
            InputError: the session has as many bodies as it may.
            Overloaded: the engine has no slot left.
        """
        body = self._bodies.get(name)
        if body is not None and not self._is_idle(body, time):
            return body
        self._forget_idle(time)
        if len(self._bodies) >= self._most:
            raise InputError(f"body {name!r} is one too many; this service takes {self._most} a session")
        fresh = Body(name, self.spare.pop() if self.spare else self._claim(), terms, label())
        if body is not None:
            fresh.reset("gap_reset")
        self._bodies[name] = fresh
        return fresh

    def restore(self, make: Callable[[int], Body]) -> Body:
        """A body that comes from a checkpoint, made for the slot it gets."""
        body = make(self._claim())
        self._bodies[body.name] = body
        return body

    def end(self, name: str) -> Release:
        """A body is gone; raises FrameError where it was never there."""
        body = self.known(name)
        del self._bodies[name]
        return Release(body.slot)

    def give_up_spare(self) -> list[Release]:
        """The slots that nobody took over."""
        spare, self.spare = self.spare, []
        return [Release(slot) for slot in spare]

    def clear(self) -> list[Release]:
        """All bodies are gone."""
        released = [Release(body.slot) for body in self._bodies.values()]
        self._bodies.clear()
        return [*self.give_up_spare(), *released]

    def _is_idle(self, body: Body, time: float) -> bool:
        return body.last is not None and time - body.last > self._idle_s

    def _forget_idle(self, time: float) -> None:
        for body in [body for body in self._bodies.values() if self._is_idle(body, time)]:
            del self._bodies[body.name]
            self.spare.append(body.slot)
