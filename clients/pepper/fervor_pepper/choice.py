"""Choosing at random, never the same twice in a row."""

import random
from collections.abc import Sequence
from typing import Generic, TypeVar

T = TypeVar("T")


class Choice(Generic[T]):
    """Draws from options; where there are several, never the one that was drawn last."""

    def __init__(self, options: Sequence[T], dice: random.Random) -> None:
        """`options`: at least one."""
        self._options = tuple(dict.fromkeys(options))
        self._dice = dice
        self._last: T | None = None

    def draw(self) -> T:
        """The next one."""
        others = [option for option in self._options if option != self._last] or list(self._options)
        self._last = self._dice.choice(others)
        return self._last
