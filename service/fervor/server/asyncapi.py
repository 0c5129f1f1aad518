"""`GET /v1/asyncapi.json`: the description of the stream, as `/openapi.json` is that of HTTP."""

from typing import Any

from fastapi import APIRouter

from fervor import __version__

router = APIRouter(prefix="/v1", tags=["stream"])


@router.get("/asyncapi.json")
async def stream_description() -> dict[str, Any]:
    """The AsyncAPI 3 document of `/v1/stream`."""
    from fervor.protocol.asyncapi import asyncapi  # few ask, and no start should wait for it

    return asyncapi(__version__)
