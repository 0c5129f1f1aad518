"""Errors over HTTP: RFC 9457 problem details with one clear sentence, and never a stack trace.

Every error response of the service has this shape, whoever raised it. `code` is the same word that a WebSocket client
finds in an `error` message.
"""

from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, HTTPException
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict, Field
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.requests import HTTPConnection
from starlette.responses import Response

from fervor.errors import FervorError

MEDIA_TYPE = "application/problem+json"

CODES = {
    400: "bad_request",
    404: "not_found",
    405: "method_not_allowed",
    408: "request_timeout",
    413: "too_large",
    426: "upgrade_required",
    431: "headers_too_large",
}
"""Codes of errors that come from the web framework and not from our own tree."""


class Problem(BaseModel):
    """What went wrong, as RFC 9457 has it."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "type": "about:blank",
                "title": "Unprocessable Content",
                "status": 422,
                "detail": "emotion 'jooy' is not known; expected one of amusement, anger, disgust, fear, …",
                "code": "bad_input",
            }
        }
    )

    type: str = Field("about:blank", description="always `about:blank`: the title is the status in words")
    title: str
    status: int
    detail: str = Field(description="one sentence: what is wrong, where, and what was expected")
    code: str = Field(description="the same in one word, for programs")
    retry_after: float | None = Field(None, description="seconds after which to try again")


def problem(status: int, detail: str, code: str, *, retry_after: float | None = None) -> Response:
    """A problem as an HTTP response; before a WebSocket is open, as its refusal."""
    headers = {}
    if retry_after is not None:
        headers["Retry-After"] = str(max(1, round(retry_after)))
    if status == HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer"
    body = Problem(title=HTTPStatus(status).phrase, status=status, detail=detail, code=code, retry_after=retry_after)
    return Response(body.model_dump_json(exclude_none=True), status, headers, MEDIA_TYPE)


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route that can end in these problems, for its OpenAPI description."""
    schema = {"$ref": "#/components/schemas/Problem"}
    return {
        status: {"description": HTTPStatus(status).phrase, "content": {MEDIA_TYPE: {"schema": schema}}}
        for status in (*statuses, 500)
    }


def tell_problems(app: FastAPI) -> None:
    """Make every error of `app` a problem."""
    app.add_exception_handler(FervorError, _fervor_error)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(StarletteHTTPException, _http_error)
    app.add_exception_handler(Exception, _fault)


async def _fervor_error(_: HTTPConnection, error: Exception) -> Response:
    assert isinstance(error, FervorError)
    return problem(error.http_status, error.message, error.code, retry_after=error.retry_after)


async def _invalid(_: HTTPConnection, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    place = " ".join(str(part) for part in first["loc"]) or "the request"
    if first["type"] == "missing":
        return problem(422, f"{place} is missing", "bad_request")
    came = repr(first["input"])
    shown = came if len(came) <= 60 else came[:57] + "..."
    return problem(422, f"{place}: {first['msg'][:1].lower()}{first['msg'][1:]}, but {shown} came", "bad_request")


async def _http_error(connection: HTTPConnection, error: Exception) -> Response:
    assert isinstance(error, StarletteHTTPException)
    path, method = connection.url.path, connection.scope.get("method", "GET")
    sentences = {404: f"there is nothing at {path}", 405: f"{path} does not take {method}"}
    detail = str(error.detail)
    if detail == HTTPStatus(error.status_code).phrase:
        detail = sentences.get(error.status_code, detail)
    response = problem(error.status_code, detail, CODES.get(error.status_code, "bad_request"))
    response.headers.update(error.headers or {})
    return response


async def _fault(_: HTTPConnection, __: Exception) -> Response:
    return problem(500, "the service failed on this request; the fault is its own and was logged", FervorError.code)


def too_large(limit: int) -> HTTPException:
    """A request body above `limit` bytes, in the one form that the web framework lets through from reading a body."""
    return HTTPException(413, f"the request is larger than {limit} bytes, the most that this service takes")
