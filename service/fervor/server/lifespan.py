"""Start and end of the service: proven before the first client comes, tidy after the last."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from fervor.server.service import Service
from fervor.server.timeouts import watch_timeouts

log = logging.getLogger(__name__)

LOOPBACK = ("127.0.0.1", "::1", "localhost")


@asynccontextmanager
async def lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Run one step, so that no client waits for the first one; free the scoring process at the end."""
    service = app.state.service
    assert isinstance(service, Service)
    await service.probe.run()
    metadata = service.model.metadata
    log.info("model %s %s (%s)", metadata.name, metadata.version, metadata.purpose)
    settings = service.settings
    if not (settings.checkpoint_keys or settings.checkpoint_keys_file):
        log.info("no FERVOR_CHECKPOINT_KEYS: streams survive a cut connection, but not a restart of this service")
    if settings.page == "on" and not service.page_tokens.known and settings.host not in LOOPBACK:
        log.info("the live page shows everybody who reaches it all bodies: see FERVOR_TOKENS and FERVOR_PAGE=off")
    watches = [
        asyncio.create_task(service.metrics.watch_loop()),
        asyncio.create_task(service.shedding.run(service.drain)),
        asyncio.create_task(watch_timeouts(service.drain)),
    ]
    try:
        yield
    finally:
        for watch in watches:
            watch.cancel()
        await service.scoring.close()
        service.tracing.close()
