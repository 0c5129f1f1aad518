"""Bearer tokens: whoever shows one of the service's tokens may in; without tokens in the settings, everybody may.

A token comes in the header `Authorization: Bearer …`, or, from browsers, which can't set headers on a WebSocket, as
one more subprotocol `fervor.token.…` beside the protocol itself.
"""

import hmac
from collections.abc import Iterator

from starlette.requests import HTTPConnection

from fervor.errors import AuthError
from fervor.server.service import service_of

TOKEN_SUBPROTOCOL = "fervor.token."  # noqa: S105  # a prefix, not a secret
"""Prefix of a subprotocol entry that is a token."""


async def require_token(connection: HTTPConnection) -> None:
    """Let a request or a WebSocket in, or not.

    Raises:
        AuthError: the service has tokens, and none of them was shown.
    """
    tokens = [token.get_secret_value().encode() for token in service_of(connection).settings.tokens]
    if not tokens:
        return
    shown = list(_shown(connection))
    # Every pair is compared, so that the time taken says nothing of how near a guess was.
    if not sum(hmac.compare_digest(token, guess) for token in tokens for guess in shown):
        raise AuthError("this service needs a token that it knows; expected Authorization: Bearer with it")


def _shown(connection: HTTPConnection) -> Iterator[bytes]:
    """The tokens that a client shows, at most a few."""
    scheme, _, token = connection.headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        yield token.strip().encode()
    for entry in connection.scope.get("subprotocols", [])[:8]:
        if entry.startswith(TOKEN_SUBPROTOCOL):
            yield entry.removeprefix(TOKEN_SUBPROTOCOL).encode()
