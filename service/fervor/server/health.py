"""Health: alive is that the loop turns, ready is that a real step of the model gives a finite number."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends
from pydantic import BaseModel
from starlette.responses import Response

from fervor.errors import EngineError
from fervor.server.problems import problem, problem_responses
from fervor.server.service import Service, service_of

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """A good answer; everything else is a problem."""

    status: Literal["alive", "ready"]


@router.get("/healthz")
async def alive() -> Health:
    """The process lives and its event loop turns; restart it if this does not answer."""
    return Health(status="alive")


@router.get("/readyz", response_model=Health, responses=problem_responses(503))
async def ready(service: Annotated[Service, Depends(service_of)]) -> Health | Response:
    """A step of the model was run just now and gave a finite intensity; send no clients here if this fails."""
    if service.drain.started:
        return problem(503, "this service is on its way out", "going_away", retry_after=1.0)
    try:
        await service.probe.run()
    except EngineError as error:
        return problem(503, error.message, error.code, retry_after=1.0)
    return Health(status="ready")
