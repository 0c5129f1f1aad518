"""When to connect again after a stream was cut, and when to give up. No clock and no dice but those handed in.

Rules: what another try may cure is tried again, after a pause that doubles from `FIRST_PAUSE_S` to `LONGEST_PAUSE_S`
and of which a random part is waited (full jitter, so that a fleet does not come back as one) · a service that says when
to come back is not asked earlier · an outage lasts until a frame is answered again or a connection has held for
`STABLE_S`, so that a service that dies at every frame is not asked for ever · after `retry_for` seconds it is over.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass

from fervor.errors import FervorError, IdleTimeout, Overloaded, StartTimeout, Unreachable

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 5.0

STABLE_S = 10.0
"""A connection that held this long ends an outage, even if no frame was sent on it."""

MOST_FAULTS = 3
"""Times that a fault of the service's own may follow a resume before it counts as caused by this stream."""


@dataclass(frozen=True, slots=True)
class Reconnect:
    """What `on_reconnect` is told: the connection is lost, an attempt failed, or the stream goes on."""

    reason: FervorError
    """Why the connection was lost, or why the last attempt failed."""
    attempt: int
    """The attempt that follows or, when the stream goes on, that succeeded; from 1."""
    seconds: float
    """Since the connection was lost."""
    delay_s: float | None = None
    """Until the attempt that follows; None: the stream goes on."""
    anew: tuple[str, ...] = ()
    """Bodies of which the service knows nothing any more: their next estimate is flagged `reset`."""
    exact: bool = True
    """Estimates are equal to the bit to those of an uninterrupted stream; else, on another kind of machine, to 1e-6."""


def worth_retrying(error: FervorError) -> bool:
    """Whether the same attempt may succeed later: nobody there, no room, silence, or a fault of the service's own."""
    return isinstance(error, Unreachable | Overloaded | StartTimeout | IdleTimeout) or _is_fault(error)


class Retries:
    """The outages of one session."""

    def __init__(
        self, retry_for: float | None, *, now: Callable[[], float], dice: Callable[[], float] = random.random
    ) -> None:
        """`retry_for`: seconds to try for, None: for ever. `dice`: throws a number in [0, 1)."""
        self.attempt = 0
        self.reason = FervorError("nothing failed")
        """The newest failure."""
        self._retry_for = retry_for
        self._now = now
        self._dice = dice
        self._lost: float | None = None  # seconds, when the outage began
        self._first = self.reason
        self._up: float | None = None
        self._faults = 0

    @property
    def seconds(self) -> float:
        """How long the outage lasts."""
        return 0.0 if self._lost is None else self._now() - self._lost

    def failed(self, error: FervorError, *, curable: bool = False) -> float | None:
        """The connection was lost, or an attempt failed: seconds until the next attempt, None to give up.

        `curable`: the next attempt will differ so that this error can't come again.
        """
        if self._up is not None and self._now() - self._up >= STABLE_S:
            self.answered()
        self._up = None
        if self._lost is None:
            self._lost, self._first, self.attempt = self._now(), error, 0
        self.reason = error
        self._faults += _is_fault(error)
        left = float("inf") if self._retry_for is None else self._retry_for - self.seconds
        if not (curable or worth_retrying(error)) or left <= 0.0 or self._faults > MOST_FAULTS:
            return None
        self.attempt += 1
        pause = self._dice() * min(FIRST_PAUSE_S * 2.0 ** min(self.attempt - 1, 16), LONGEST_PAUSE_S)
        return min((error.retry_after or 0.0) + pause, left)

    def connected(self) -> None:
        """There is a connection again."""
        self._up = self._now()

    def answered(self) -> None:
        """A frame was answered: the outage, if there was one, is over."""
        self._lost, self._faults = None, 0

    def surrender(self) -> FervorError:
        """The error to end with: the first failure, how long it was tried to mend, and what failed last."""
        if self.attempt == 0:
            return self._first
        times = "once" if self.attempt == 1 else f"{self.attempt} times"
        last = "" if self.reason is self._first else f", the last time: {self.reason.message}"
        kind = type(self.reason if not worth_retrying(self.reason) else self._first)
        error = kind(f"{self._first.message}; tried to reconnect {times} in {self.seconds:.0f} s{last}")
        error.retry_after = self.reason.retry_after
        return error


def _is_fault(error: FervorError) -> bool:
    return type(error) is FervorError


class Pace:
    """How fast a backlog may leave: below the frames a second that a service takes from one session."""

    def __init__(self, frames_per_second: float, now: Callable[[], float]) -> None:
        self._rate = 0.95 * frames_per_second
        self._left = self._most = max(frames_per_second / 2.0, 1.0)
        self._now = now
        self._then = now()

    def wait_s(self) -> float:
        """Seconds until the next frame may leave."""
        now = self._now()
        self._left = min(self._most, self._left + (now - self._then) * self._rate)
        self._then = now
        return max((1.0 - self._left) / self._rate, 0.0)

    def take(self) -> None:
        """A frame leaves."""
        self._left -= 1.0
