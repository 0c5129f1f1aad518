"""Those who watch the live page: how many there are, and whether one more may."""

from collections.abc import Iterator
from contextlib import contextmanager

from fervor.errors import Overloaded


class Watchers:
    """The live pages that are open."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.open = 0

    @contextmanager
    def admitted(self) -> Iterator[None]:
        """Room for one more, while it lasts.

        Raises:
            Overloaded: there are as many as may be.
        """
        if self.open >= self._most:
            raise Overloaded(f"{self.open} live pages are open, as many as this service takes", retry_after=5.0)
        self.open += 1
        try:
            yield
        finally:
            self.open -= 1
