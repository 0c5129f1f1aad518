"""How many frames a second a session may send: an allowance that refills with time, one second's worth at most."""

from fervor.errors import RateExceeded


class Pace:
    """The allowance of one session."""

    __slots__ = ("_left", "_most", "_rate", "_then")

    def __init__(self, frames_per_second: float, burst: int) -> None:
        """Start with a full allowance: a second's frames, or one whole message (`burst`) where that is more."""
        self._rate = frames_per_second
        self._most = max(frames_per_second, float(burst))
        self._left = self._most
        self._then = 0.0

    def has_room(self, frames: int) -> bool:
        """Whether so many could be taken if no time had passed."""
        return frames <= self._left

    def take(self, frames: int, now: float) -> None:
        """Use up allowance for `frames` at `now` (seconds, any steady clock).

        Raises:
            RateExceeded: there is not that much.
        """
        self._left = min(self._most, self._left + (now - self._then) * self._rate)
        self._then = now
        if frames > self._left:
            raise RateExceeded(f"more than {self._rate:g} frames a second came", retry_after=1.0)
        self._left -= frames
