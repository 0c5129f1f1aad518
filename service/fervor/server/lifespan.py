"""Start and end of the service: proven before the first client comes, tidy after the last."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from fervor.server.service import Service

log = logging.getLogger(__name__)


@asynccontextmanager
async def lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Run one step, so that no client waits for the first one; free the scoring process at the end."""
    service = app.state.service
    assert isinstance(service, Service)
    await service.probe.run()
    metadata = service.model.metadata
    log.info("model %s %s (%s)", metadata.name, metadata.version, metadata.purpose)
    if not (service.settings.checkpoint_keys or service.settings.checkpoint_keys_file):
        log.info("no FERVOR_CHECKPOINT_KEYS: streams survive a cut connection, but not a restart of this service")
    watches = [
        asyncio.create_task(service.metrics.watch_loop()),
        asyncio.create_task(service.shedding.run(service.drain)),
    ]
    try:
        yield
    finally:
        for watch in watches:
            watch.cancel()
        await service.scoring.close()
        service.tracing.close()
