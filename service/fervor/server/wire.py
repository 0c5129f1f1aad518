"""What a conversation needs of a connection, whoever carries it: messages in and out, in order, and a close.

Two ways lead to a client. The ordinary one is ASGI's, with a task that waits for what comes (`asgi_wire`); any server
can carry it. The direct one (`direct_wire`) is offered by our own protocol class: the connection itself calls the
conversation, and the conversation the connection, so that neither needs a task.
"""

from typing import Protocol

from fervor.errors import CloseCode

EXTENSION = "fervor"
"""Where a connection that offers the direct way stands among the extensions of an ASGI scope."""


class Listener(Protocol):
    """The conversation at our end of a wire. None of this raises."""

    def came(self, message: str | bytes) -> None:
        """A message came."""

    def writable(self) -> None:
        """The wire takes messages again that it did not take before."""

    def lost(self) -> None:
        """The connection is gone: nothing comes any more, and nothing can be sent. May be called twice."""


class Wire(Protocol):
    """One WebSocket, whose handshake is done or under way."""

    @property
    def stuck(self) -> bool:
        """Whether the client takes nothing just now."""

    async def carry(self, listener: Listener) -> None:
        """Bring everything that comes to `listener`, once the handshake is done; may return long before the end."""

    def write(self, message: str | bytes) -> bool:
        """Send a message, after all before; False, having done nothing, where none can be taken just now.

        Then `writable` says when, unless the connection is `lost` first.
        """

    def close(self, code: CloseCode, reason: str) -> bool:
        """Close, after everything that was sent; False as above."""

    def pause(self) -> None:
        """Read no further, for now; what was read already may still come."""

    def resume(self) -> None:
        """Read on."""

    def leave(self) -> None:
        """The conversation is over: bring nothing more, and let the connection end."""

    def look(self, now: float) -> None:
        """See, about once a second, whether the client is still there; `now` is the event loop's time, seconds."""


class Shortcut(Protocol):
    """A connection before its handshake, that can do without ASGI after it."""

    def offer(self) -> Wire:
        """The wire that takes the connection over as soon as the handshake is accepted."""
