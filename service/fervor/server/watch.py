"""`GET /v1/watch`: the WebSocket that the live page listens to. Read-only: nothing that comes on it reaches a session.

With several workers a watcher sees the sessions of the one that took its connection.
"""

import asyncio
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Depends, WebSocket, WebSocketDisconnect
from pydantic import ValidationError
from starlette.responses import Response

from fervor.errors import CloseCode
from fervor.protocol.codec import one_sentence
from fervor.server.problems import problem, problem_responses
from fervor.server.service import Service, service_of
from fervor.server.watch_messages import SUBPROTOCOL, Look
from fervor.server.watching import RATE_HZ, started, take_snapshot

router = APIRouter(prefix="/v1", tags=["watch"])

PATH = "/v1/watch"

CLOSE_REASON_BYTES = 120
"""A close frame has room for a few more."""


@router.websocket("/watch")
async def watch(websocket: WebSocket, service: Annotated[Service, Depends(service_of)]) -> None:
    """Show what the service sees."""
    agreed = SUBPROTOCOL if SUBPROTOCOL in websocket.scope["subprotocols"] else None
    with service.watchers.admitted():
        await websocket.accept(agreed)
        await Watch(websocket, service).run()


@router.get("/watch", status_code=426, response_class=Response, responses=problem_responses(401, 403, 426))
async def upgrade_required() -> Response:
    """The live page's WebSocket: ask for an upgrade, with the subprotocol `fervor.watch.v1.json`."""
    refusal = problem(426, f"{PATH} is a WebSocket; expected a request for an upgrade to it", "upgrade_required")
    refusal.headers.update({"Upgrade": "websocket", "Connection": "Upgrade"})
    return refusal


class Watch:
    """One watcher."""

    def __init__(self, websocket: WebSocket, service: Service) -> None:
        self._websocket = websocket
        self._service = service
        self._look = Look()

    async def run(self) -> None:
        """Show until the watcher leaves, or says what nobody understands."""
        await self._websocket.send_text(started(self._service).model_dump_json())
        showing = asyncio.create_task(self._show())
        try:
            await self._listen()
        finally:
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)

    async def _listen(self) -> None:
        with suppress(WebSocketDisconnect):
            try:
                while True:
                    self._look = Look.model_validate_json(await self._websocket.receive_text())
            except (ValidationError, KeyError) as error:  # KeyError: a binary message
                reason = one_sentence(error) if isinstance(error, ValidationError) else "expected text messages"
                cut = reason.encode()[:CLOSE_REASON_BYTES].decode(errors="ignore")
                await self._websocket.close(CloseCode.BAD_MESSAGE, cut)

    async def _show(self) -> None:
        """Send picture after picture; sending waits while the watcher takes none."""
        loop = asyncio.get_running_loop()
        due, last = loop.time(), ""
        with suppress(WebSocketDisconnect, RuntimeError):  # RuntimeError: it was closed meanwhile
            while True:
                picture = take_snapshot(self._service, self._look).model_dump_json()
                if picture != last:
                    await self._websocket.send_text(picture)
                    last = picture
                due = max(due + 1.0 / RATE_HZ, loop.time())
                await asyncio.sleep(due - loop.time())
