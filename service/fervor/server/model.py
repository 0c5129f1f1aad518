"""`GET /v1/model`: the model that answers, where it came from, and what its results depend on."""

from typing import Annotated

from fastapi import APIRouter, Depends

from fervor.server.model_info import ModelDescription, describe_model
from fervor.server.problems import problem_responses
from fervor.server.service import Service, service_of

router = APIRouter(prefix="/v1", tags=["model"])


@router.get("/model", responses=problem_responses(401, 403))
async def model(service: Annotated[Service, Depends(service_of)]) -> ModelDescription:
    """What the model is, what it was trained on and how well it does."""
    return describe_model(service.model)
