"""What waits to be sent to one client: in order, bounded in bytes.

While nothing waits, a message goes straight to the wire; what the wire does not take waits here until it does.
A client that reads too slowly fills its outbox and nobody else's. A message that a newer one makes useless (an older
checkpoint of the body; with delivery `latest`, an older estimate) leaves when that comes: newest wins. Who puts into a
full outbox is told so and decides.
"""

from collections import OrderedDict
from collections.abc import Hashable

from fervor.server.wire import Wire
from fervor.session.events import Close


class Outbox:
    """Messages to one client."""

    __slots__ = ("_bytes", "_most_bytes", "_put", "_waiting", "_wire", "bytes_sent", "closed", "superseded")

    def __init__(self, wire: Wire, *, most_bytes: int) -> None:
        self._wire = wire
        self._most_bytes = most_bytes
        self._waiting: OrderedDict[Hashable, str | bytes | Close] | None = None  # while something does
        self._bytes = 0
        self._put = 0
        self.bytes_sent = 0
        self.superseded = 0
        self.closed = False
        """Whether a close was sent."""

    @property
    def full(self) -> bool:
        """Whether the client takes no bytes just now, and more waits for it than may."""
        return self._bytes > self._most_bytes and self._wire.stuck

    def put(self, message: str | bytes | Close, *, topic: Hashable = None) -> None:
        """Send this after everything put before; a `Close` is the last.

        Args:
            message: encoded.
            topic: takes the place of what still waits under the same topic; None for none.
        """
        if self._waiting is None:
            if self._send(message):
                return
            self._waiting = OrderedDict()
        self._put += 1
        key = self._put if topic is None else topic
        old = self._waiting.pop(key, None)
        if old is not None and not isinstance(old, Close):
            self._bytes -= len(old)
            self.superseded += 1
        self._waiting[key] = message
        self._bytes += 0 if isinstance(message, Close) else len(message)

    def flush(self) -> None:
        """Send what waits, as far as the wire takes it."""
        while self._waiting:
            key, message = next(iter(self._waiting.items()))
            if not self._send(message):
                return
            del self._waiting[key]
            self._bytes -= 0 if isinstance(message, Close) else len(message)
        self._waiting = None

    def drop(self) -> None:
        """Forget what waits."""
        self._waiting = None
        self._bytes = 0

    def _send(self, message: str | bytes | Close) -> bool:
        if isinstance(message, Close):
            self.closed = self._wire.close(message.code, message.reason)
            return self.closed
        if not self._wire.write(message):
            return False
        self.bytes_sent += len(message)
        return True
