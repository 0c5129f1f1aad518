"""The proof that the service works: a real step on a body of its own, through the batcher that serves everybody."""

import asyncio
import math

import numpy as np

from fervor.engine.batcher import Batcher
from fervor.errors import EngineError
from fervor.rotations import identity
from fervor.session.body import Body, Terms
from fervor.session.events import Outcome, Pose, Source, Ticket
from fervor.skeletons.canonical import C13
from fervor.skeletons.rig import JOINTS

PATIENCE_S = 2.0
"""How long a step may take before the service counts as not ready; a frame's step takes under a millisecond."""


class Probe:
    """A person standing still, who belongs to the service."""

    def __init__(self, batcher: Batcher) -> None:
        self._batcher = batcher
        self._slot = batcher.engine.claim()
        self._terms = Terms(batcher.engine.model.metadata, Source(C13, "local"))

    async def run(self) -> None:
        """Take one step.

        Raises:
            EngineError: it failed, gave no finite number, or took longer than `PATIENCE_S`.
        """
        ticket = Body("probe", self._slot, self._terms).plan(0, 0.0, _STANDING)
        answer: asyncio.Future[Outcome | EngineError] = asyncio.get_running_loop().create_future()

        def deliver(_: Ticket, outcome: Outcome | EngineError) -> None:
            if not answer.done():
                answer.set_result(outcome)

        self._batcher.submit(ticket, deliver)
        try:
            async with asyncio.timeout(PATIENCE_S):
                outcome = await answer
        except TimeoutError:
            raise EngineError(f"a step of the model took longer than {PATIENCE_S:g} s") from None
        if isinstance(outcome, EngineError):
            raise outcome
        if outcome.intensity is None or not math.isfinite(outcome.intensity):
            raise EngineError("a step of the model gave no finite intensity")


_STANDING = Pose(identity((len(JOINTS),), np.float64), np.ones(len(JOINTS), np.bool_))
