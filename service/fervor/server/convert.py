"""`POST /v1/convert`: a recording on the rig, so that a program without readers of its own can stream it.

The live page does: it sends what was dropped on it here, and the frames that come back to `/v1/stream`.
"""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response

from fervor.server.problems import problem_responses
from fervor.server.score import read_body
from fervor.server.service import Service, service_of

router = APIRouter(prefix="/v1", tags=["score"])

JSON_LINES = "application/jsonl"

_FILE = {"schema": {"type": "string", "format": "binary"}}

BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {"application/octet-stream": _FILE}}}

ANSWER: dict[int | str, dict[str, Any]] = {
    200: {"description": "JSON lines: a header, then one frame a line", "content": {JSON_LINES: {}}}
}


class ConvertOptions(BaseModel):
    """What goes with a recording, as query."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    filename: str = Field("", description="says the kind of file, and its name in errors")
    skeleton: str | None = Field(None, description="for tables that don't name theirs; BVH and MVNX bring their own")


@router.post(
    "/convert",
    response_class=Response,
    responses=ANSWER | problem_responses(401, 403, 413, 422, 503),
    openapi_extra=BODY,
)
async def convert(
    request: Request,
    service: Annotated[Service, Depends(service_of)],
    options: Annotated[ConvertOptions, Query()],
) -> Response:
    """Convert a motion file (BVH, MVNX, CSV, JSONL, NPZ), which is the body, to the rig's 13 local rotations."""
    body = await read_body(request, service.settings.score_max_bytes)
    lines = await service.scoring.run("convert_file", body, options.filename, options.skeleton)
    return Response(lines, media_type=JSON_LINES)
