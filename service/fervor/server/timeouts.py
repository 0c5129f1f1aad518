"""One look a second at all conversations, for their timeouts.

A timer for each would cost more memory, and no less time.
"""

import asyncio
import logging

from fervor.server.draining import Drain

log = logging.getLogger(__name__)

EVERY_S = 1.0
"""Seconds between two looks: a timeout may come so much later than it is due."""

TOGETHER = 256
"""Conversations that are looked at before what came meanwhile has its turn."""


async def watch_timeouts(drain: Drain) -> None:
    """Let every conversation see what time it is, for ever."""
    loop = asyncio.get_running_loop()
    while True:
        await asyncio.sleep(EVERY_S)
        for place, conversation in enumerate(list(drain.talking)):
            if place % TOGETHER == TOGETHER - 1:
                await asyncio.sleep(0)
            try:
                conversation.look(loop.time())
            except Exception:  # one session's fault must not cost the others their timeouts
                log.exception("a session failed on its timeouts")
