"""How to open a connection to a service: once for each twin."""

import contextlib
import ssl as tls
from dataclasses import dataclass, field
from typing import Any, Self

from websockets.asyncio.client import ClientConnection as AsyncConnection
from websockets.asyncio.client import connect as open_async
from websockets.sync.client import ClientConnection as SyncConnection
from websockets.sync.client import connect as open_sync
from websockets.typing import Subprotocol

from fervor_client.address import stream_url, without_secrets
from fervor_client.failures import SUBPROTOCOL

CLOSE_TIMEOUT_S = 2.0
"""Longest wait for the other side when closing."""

KEEPALIVE_S = 5.0
"""Between the pings of WebSocket itself, which notice a network that went away without a word."""

KEEPALIVE_PATIENCE_S = 10.0
"""Longest wait for a pong: a loaded service may be slow."""

MOST_BYTES = 4 * 1024 * 1024
"""Longest message taken: a `session.calibrated` brings a checkpoint of each body, up to 40 kB with a window."""


@dataclass(frozen=True, slots=True)
class Way:
    """The way to a service."""

    url: str = field(repr=False)
    shown: str
    """The address without secrets."""
    token: str | None = field(repr=False)
    ssl: tls.SSLContext | None
    timeout_s: float
    """For connecting and starting."""

    @classmethod
    def to(cls, url: str, *, token: str | None, ssl: tls.SSLContext | None, timeout_s: float) -> Self:
        """The way to `url`; raises InputError where that is no address."""
        url = stream_url(url)
        return cls(url, without_secrets(url), token, ssl, timeout_s)

    async def open_async(self) -> AsyncConnection:
        """A connection for asyncio; the caller sees to the timeout."""
        return await open_async(self.url, open_timeout=None, **self._options)

    def open_sync(self) -> SyncConnection:
        """A connection for threads; the caller sees to closing it."""
        with contextlib.ExitStack() as undo:
            connection: SyncConnection = undo.enter_context(
                open_sync(self.url, open_timeout=self.timeout_s, **self._options)
            )
            undo.pop_all()
        return connection

    @property
    def _options(self) -> dict[str, Any]:
        options: dict[str, Any] = {
            "subprotocols": [Subprotocol(SUBPROTOCOL)],
            "compression": None,
            "max_size": MOST_BYTES,
            "additional_headers": {"Authorization": f"Bearer {self.token}"} if self.token else {},
            "close_timeout": CLOSE_TIMEOUT_S,
            "ping_interval": KEEPALIVE_S,
            "ping_timeout": KEEPALIVE_PATIENCE_S,
        }
        return options if self.ssl is None else {**options, "ssl": self.ssl}
