"""`GET /metrics`, in Prometheus' text format."""

from typing import Annotated

from fastapi import APIRouter, Depends
from prometheus_client import generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from starlette.responses import Response

from fervor.server.service import Service, service_of

router = APIRouter(tags=["metrics"])


@router.get("/metrics", response_class=Response)
async def metrics(service: Annotated[Service, Depends(service_of)]) -> Response:
    """All metrics of this service."""
    return Response(generate_latest(service.metrics.shown), media_type=CONTENT_TYPE_PLAIN_0_0_4)
