"""The service as an ASGI application: routes, problems, description. Everything else has a file of its own."""

from typing import Any

from fastapi import Depends, FastAPI
from fastapi.middleware.cors import CORSMiddleware

from fervor import __version__
from fervor.server import asyncapi, convert, health, model, page, score, scrape, skeletons, stream, watch
from fervor.server.auth import require_token, require_watcher
from fervor.server.description import describe
from fervor.server.lifespan import lifespan
from fervor.server.problems import tell_problems
from fervor.server.service import Service
from fervor.settings import Settings


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service, its model loaded and proven.

    Args:
        settings: as read at start; None reads them from the environment.

    Raises:
        SettingsError: a setting that can't be used.
        ModelFileError: a model file whose contract the service can't meet.
    """
    service = Service.open(settings or Settings.load())
    app = FastAPI(
        title="fervor",
        version=__version__,
        summary="Live emotional intensity from body poses, for robots.",
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        lifespan=lifespan,
        redirect_slashes=False,
    )
    app.state.service = service
    tell_problems(app)
    for part in (stream, score, convert, model, skeletons):
        app.include_router(part.router, dependencies=[Depends(require_token)])
    app.include_router(health.router)
    app.include_router(asyncapi.router)
    app.include_router(scrape.router)
    if service.settings.page == "on":
        app.include_router(watch.router, dependencies=[Depends(require_watcher)])
        page.serve_page(app)

    if service.settings.origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=service.settings.origins,
            allow_methods=["GET", "POST"],
            allow_headers=["Authorization", "Content-Type"],
        )
    service.tracing.watch(app)

    def openapi() -> dict[str, Any]:
        app.openapi_schema = app.openapi_schema or describe(app)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]  # as FastAPI documents it
    return app
