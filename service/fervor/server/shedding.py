"""What becomes of more load than the model can bear: new sessions are refused, and the newest are sent away.

The measure is the wait of frames for the model, not the use of the processor, which is high on a service that is well.
A wait counts once every run for a second was too late: one stall of the machine sends nobody away. Sessions that are
sent away resume from their checkpoints elsewhere, and lose nothing; frames are never dropped.
"""

import asyncio
import time
from collections.abc import Callable
from itertools import islice

from fervor.engine.batcher import Batcher, Run
from fervor.server.draining import Drain

SUSTAINED_S = 1.0
"""Seconds of late runs, and of late runs alone, after which load is shed; and between two sheddings."""

SHARE = 0.05
"""Of the sessions, that are sent away at once."""

COME_BACK_S = 5.0
"""What a session that is sent away is told to wait, seconds."""


class Shedding:
    """Watches how late the model runs."""

    def __init__(self, batcher: Batcher, *, most_delay_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._most_delay_s = most_delay_s
        self._clock = clock
        self._late_since: float | None = None
        self._newest_run = 0.0
        batcher.watch(self.note)

    @property
    def overloaded(self) -> bool:
        """Whether the model has been late for long."""
        now = self._clock()
        if self._late_since is None or now - self._newest_run > SUSTAINED_S:
            return False
        return now - self._late_since >= SUSTAINED_S

    def note(self, run: Run) -> None:
        """A run ended."""
        now = self._clock()
        if run.waited + run.seconds < self._most_delay_s:
            self._late_since = None
        elif self._late_since is None or now - self._newest_run > SUSTAINED_S:
            self._late_since = now
        self._newest_run = now

    async def run(self, drain: Drain) -> None:
        """Send sessions away while there is need, for ever."""
        while True:
            await asyncio.sleep(SUSTAINED_S)
            if self.overloaded:
                self.shed(drain)

    def shed(self, drain: Drain) -> None:
        """Send away the newest sessions: those before them were promised room first."""
        count = max(1, int(SHARE * len(drain.talking)))
        for conversation in list(islice(reversed(drain.talking), count)):
            conversation.send_away(COME_BACK_S)
