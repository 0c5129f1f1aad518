"""`GET /v1/watch`: the WebSocket that the live page listens to. Read-only: nothing that comes on it reaches a session.

With several workers a watcher sees the sessions of the one that took its connection.
"""

import asyncio
import logging
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Depends, WebSocket, WebSocketDisconnect
from pydantic import ValidationError
from starlette.responses import Response
from starlette.websockets import WebSocketState

from fervor.errors import CloseCode, RateExceeded
from fervor.protocol.codec import one_sentence
from fervor.server.pace import Pace
from fervor.server.problems import problem, problem_responses
from fervor.server.service import Service, service_of
from fervor.server.watch_messages import SUBPROTOCOL, Look
from fervor.server.watching import RATE_HZ, started, take_snapshot

log = logging.getLogger(__name__)

router = APIRouter(prefix="/v1", tags=["watch"])

PATH = "/v1/watch"

LOOKS_PER_SECOND = 20
"""More than anybody leafs; a watcher that says more is cut off."""

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
        self._pace = Pace(LOOKS_PER_SECOND, LOOKS_PER_SECOND)

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
                    said = await self._websocket.receive_text()
                    self._pace.take(1, asyncio.get_running_loop().time())
                    self._look = Look.model_validate_json(said)
            except RateExceeded:
                await self._close(CloseCode.RATE, f"more than {LOOKS_PER_SECOND} messages a second came")
            except ValidationError as error:
                await self._close(CloseCode.BAD_MESSAGE, one_sentence(error))
            except KeyError:  # a binary message
                await self._close(CloseCode.BAD_MESSAGE, "expected text messages")

    async def _show(self) -> None:
        """Send picture after picture; sending waits while the watcher takes none."""
        loop = asyncio.get_running_loop()
        due, last = loop.time(), ""
        with suppress(WebSocketDisconnect):
            while self._websocket.application_state is WebSocketState.CONNECTED:
                picture = self._picture()
                if picture is None:
                    await self._close(CloseCode.INTERNAL, "the service failed on this picture; the fault is its own")
                    return
                if picture != last:
                    await self._websocket.send_text(picture)
                    last = picture
                due = max(due + 1.0 / RATE_HZ, loop.time())
                await asyncio.sleep(due - loop.time())

    def _picture(self) -> str | None:
        """What there is to see, as JSON; None where a fault of ours hides it, which costs this watcher alone."""
        try:
            return take_snapshot(self._service, self._look).model_dump_json()
        except Exception:
            log.exception("a live page could not be shown")
            return None

    async def _close(self, code: CloseCode, reason: str) -> None:
        await self._websocket.close(code, reason.encode()[:CLOSE_REASON_BYTES].decode(errors="ignore"))
