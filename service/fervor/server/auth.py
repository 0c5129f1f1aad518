"""At the door: who shows a token that the service knows may in, and web pages only of origins that may.

A token comes in the header `Authorization: Bearer …`, or, from browsers, which can't set headers on a WebSocket, as
one more subprotocol `fervor.token.…` beside the protocol itself.
"""

from collections.abc import Iterator

from starlette.requests import HTTPConnection

from fervor.errors import AuthError, OriginRefused
from fervor.server.service import service_of

TOKEN_SUBPROTOCOL = "fervor.token."  # noqa: S105  # a prefix, not a secret
"""Prefix of a subprotocol entry that is a token."""

MOST_SHOWN = 8
"""Tokens that one request may show."""


async def require_token(connection: HTTPConnection) -> None:
    """Let a request or a WebSocket in, or not; keeps the client's name in `connection.state.client`.

    Raises:
        OriginRefused: it comes from a web page that may not use the service.
        AuthError: the service has tokens, and none of them was shown.
    """
    service = service_of(connection)
    try:
        service.origins.check(connection.headers.get("origin"), connection.headers.get("host", ""))
        connection.state.client = service.tokens.holder(_shown(connection))
    except (AuthError, OriginRefused) as error:
        if connection.scope["type"] == "websocket":
            service.metrics.note_refusal(error.code)
        raise


async def require_watcher(connection: HTTPConnection) -> None:
    """Let somebody watch the live page, or not.

    Raises:
        OriginRefused: it comes from a web page that may not use the service.
        AuthError: watchers need a token, and none of theirs was shown.
    """
    service = service_of(connection)
    service.origins.check(connection.headers.get("origin"), connection.headers.get("host", ""))
    service.page_tokens.holder(_shown(connection))


def _shown(connection: HTTPConnection) -> Iterator[bytes]:
    """The tokens that a client shows, at most a few."""
    scheme, _, token = connection.headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        yield token.strip().encode()
    for entry in connection.scope.get("subprotocols", [])[:MOST_SHOWN]:
        if entry.startswith(TOKEN_SUBPROTOCOL):
            yield entry.removeprefix(TOKEN_SUBPROTOCOL).encode()
