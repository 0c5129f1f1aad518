"""`GET /v1/stream`: the handshake. What is said on the socket afterwards is a `Conversation`.

Refusals before the upgrade are HTTP problems: an unknown subprotocol, a wrong token, no room.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Depends, WebSocket, WebSocketDisconnect
from starlette.responses import Response

from fervor.errors import ProtocolError
from fervor.protocol.codec import CODECS, Codec, JsonCodec
from fervor.server.asgi_wire import AsgiWire
from fervor.server.auth import TOKEN_SUBPROTOCOL
from fervor.server.conversation import Conversation
from fervor.server.problems import problem, problem_responses
from fervor.server.service import Service, service_of
from fervor.server.wire import EXTENSION, Shortcut, Wire

router = APIRouter(prefix="/v1", tags=["stream"])

PATH = "/v1/stream"


@router.websocket("/stream")
async def stream(websocket: WebSocket, service: Annotated[Service, Depends(service_of)]) -> None:
    """Follow bodies live."""
    codec, agreed = choose_codec(websocket.scope["subprotocols"])
    service.sessions.admit()
    conversation: Conversation | None = None
    try:
        wire = wire_to(websocket)
        with suppress(WebSocketDisconnect):
            await websocket.accept(agreed)
            conversation = Conversation(wire, service, codec, client=websocket.state.client)
    finally:
        if conversation is None:
            service.sessions.leave()
    if conversation is not None:
        await conversation.run()


@router.get("/stream", status_code=426, response_class=Response, responses=problem_responses(401, 403, 426))
async def upgrade_required() -> Response:
    """The live stream is a WebSocket: ask for an upgrade, with a subprotocol of `fervor.v1.json`."""
    refusal = problem(426, f"{PATH} is a WebSocket; expected a request for an upgrade to it", "upgrade_required")
    refusal.headers.update({"Upgrade": "websocket", "Connection": "Upgrade"})
    return refusal


def choose_codec(offered: Sequence[str]) -> tuple[Codec, str | None]:
    """The codec for what a client offers, and the subprotocol to answer with.

    A client that offers none speaks JSON; of several that are known the first wins.

    Raises:
        ProtocolError: none of those offered is known.
    """
    names = [name for name in offered if name and not name.startswith(TOKEN_SUBPROTOCOL)]
    if not names:
        return CODECS[JsonCodec.subprotocol], None
    for name in names:
        if name in CODECS:
            return CODECS[name], name
    shown = ", ".join(names)[:100]
    raise ProtocolError(f"subprotocol {shown} is not known; expected {' or '.join(CODECS)}")


def wire_to(websocket: WebSocket) -> Wire:
    """The best wire that the server of a WebSocket offers; to be asked for before it is accepted."""
    shortcut: Shortcut | None = websocket.scope.get("extensions", {}).get(EXTENSION)
    return AsgiWire(websocket) if shortcut is None else shortcut.offer()
