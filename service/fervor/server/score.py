"""`POST /v1/score` and `/v1/score/file`: whole recordings, with the estimates that a live stream would have got.

The routes read no more than is allowed and hand the body on unread; see `scoring_process` for why.
"""

from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.requests import ClientDisconnect
from starlette.responses import Response, StreamingResponse

from fervor.errors import RequestError
from fervor.server.problems import problem_responses, too_large
from fervor.server.scoring_models import MULTIPART, FileOptions, ScoreResponse
from fervor.server.scoring_process import Job
from fervor.server.scoring_progress import LINES, NDJSON, lines_of, wants_lines
from fervor.server.scoring_requests import MSGPACK
from fervor.server.service import Service, service_of

router = APIRouter(prefix="/v1", tags=["score"])

PROBLEMS = problem_responses(401, 403, 413, 422, 503)

_FILE = {"type": "string", "format": "binary"}

_LINES = {"oneOf": [{"$ref": f"#/components/schemas/{line.__name__}"} for line in LINES]}

RESPONSES: dict[int | str, dict[str, Any]] = {
    **PROBLEMS,
    200: {
        "description": "The scores; as lines of JSON with progress before them, where Accept asks for those",
        "content": {NDJSON: {"schema": _LINES}},
    },
}

_PACKED = {**_FILE, "description": "a ScoreRequest in MessagePack; q and p may be raw little-endian float32"}

SEQUENCES_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {"schema": {"$ref": "#/components/schemas/ScoreRequest"}},
            **{kind: {"schema": _PACKED} for kind in MSGPACK},
        },
    }
}

FILE_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            MULTIPART: {
                "schema": {
                    "type": "object",
                    "properties": {
                        "file": {"type": "array", "items": _FILE, "description": "one or more recordings"},
                        "emotion": {"type": "string", "description": "options may come as fields too"},
                    },
                    "required": ["file"],
                }
            },
            "application/octet-stream": {"schema": _FILE},
        },
    }
}


@router.post("/score", response_model=ScoreResponse, responses=RESPONSES, openapi_extra=SEQUENCES_BODY)
async def score(request: Request, service: Annotated[Service, Depends(service_of)]) -> Response:
    """Score one or many sequences of frames: a summary of each or, with `detail: frames`, every estimate.

    With `Accept: application/x-ndjson` the answer comes as lines of JSON that tell of progress first.
    """
    body = await read_body(request, service.settings.score_max_bytes)
    return await _answer(request, service, "score", body, request.headers.get("content-type", ""))


@router.post("/score/file", response_model=ScoreResponse, responses=RESPONSES, openapi_extra=FILE_BODY)
async def score_file(
    request: Request,
    service: Annotated[Service, Depends(service_of)],
    options: Annotated[FileOptions, Query()],
) -> Response:
    """Score motion files (BVH, MVNX, CSV, JSONL, NPZ).

    They come as files of a form, or one as the body itself with its `filename` in the query. With
    `Accept: application/x-ndjson` the answer comes as lines of JSON that tell of progress first.
    """
    body = await read_body(request, service.settings.score_max_bytes)
    content_type = request.headers.get("content-type", "")
    return await _answer(request, service, "score_files", body, content_type, options.model_dump(exclude_unset=True))


async def read_body(request: Request, limit: int) -> bytes:
    """The body of a request, of at most `limit` bytes; a longer one is refused before it is read to its end."""
    if int(request.headers.get("content-length", 0)) > limit:
        raise too_large(limit)
    body = bytearray()
    try:
        async for chunk in request.stream():
            body += chunk
            if len(body) > limit:
                raise too_large(limit)
    except ClientDisconnect:
        raise RequestError("the client went away before its request was whole") from None
    return bytes(body)


async def _answer(request: Request, service: Service, job: Job, *arguments: object) -> Response:
    """The scores, or lines that lead up to them."""
    if not wants_lines(request.headers.get("accept", "")):
        return Response(await service.scoring.run(job, *arguments), media_type="application/json")
    lines = lines_of(service.scoring, job, *arguments)
    first = await anext(lines)  # what fails before it can still be told as an HTTP problem

    async def all_lines() -> AsyncIterator[bytes]:
        yield first
        async for line in lines:
            yield line

    return StreamingResponse(all_lines(), media_type=NDJSON)
