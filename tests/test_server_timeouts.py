"""The look that all conversations share."""

import asyncio
from contextlib import suppress

import pytest

from fervor.server.draining import Drain
from fervor.server.timeouts import TOGETHER, watch_timeouts


class Looked:
    """As much of a conversation as is looked at."""

    def __init__(self, *, fails: bool = False) -> None:
        self.times: list[float] = []
        self.fails = fails

    def look(self, now: float) -> None:
        self.times.append(now)
        if self.fails:
            raise RuntimeError("a fault")


async def test_everybody_is_looked_at_again_and_again_and_a_fault_costs_nobody_else(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("fervor.server.timeouts.EVERY_S", 0.0)
    drain = Drain()
    before, faulty = Looked(), Looked(fails=True)
    crowd = [Looked() for _ in range(2 * TOGETHER)]
    for conversation in (before, faulty, *crowd):
        drain.enter(conversation)
    watching = asyncio.create_task(watch_timeouts(drain))
    async with asyncio.timeout(10):
        while len(crowd[-1].times) < 3:
            await asyncio.sleep(0)
    watching.cancel()
    with suppress(asyncio.CancelledError):
        await watching
    assert all(len(conversation.times) >= 3 for conversation in (before, faulty, *crowd))
    assert before.times == sorted(before.times)
    assert "a session failed on its timeouts" in caplog.messages
