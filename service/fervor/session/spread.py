"""Spreads checkpoints over time, so that those of many bodies do not fall on one instant.

Clocks agree on when a second is full, and a checkpoint costs as much as a frame or two. So with the frames of one turn
go only some; a body that is put off gets its checkpoint with one of its next frames, and from then on at that part of
every span. No estimate depends on it.
"""

LEAST = 2
"""Checkpoints that any turn has room for: few bodies never wait."""

FRAMES_EACH = 16
"""Frames of a turn that make room for one more."""


class Spread:
    """The checkpoints of a turn."""

    __slots__ = ("_frames", "_given")

    def __init__(self) -> None:
        self._frames = 0
        self._given = 0

    def begin(self) -> None:
        """A new turn."""
        self._frames = self._given = 0

    def note(self) -> None:
        """A frame of this turn."""
        self._frames += 1

    def take(self) -> bool:
        """Room for a checkpoint, unless the turn has had its share."""
        if self._given >= LEAST + self._frames // FRAMES_EACH:
            return False
        self._given += 1
        return True
