"""What waits to be sent to one client: in order, bounded in bytes.

While nothing waits, a message is written at once if the wire can; all else is sent by one task.
A client that reads too slowly fills its outbox and nobody else's. A message that a newer one makes useless (an older
checkpoint of the body; with delivery `latest`, an older estimate) leaves when that comes: newest wins. Who puts into a
full outbox is told so and decides.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Hashable

from fervor.server.wire import Wire
from fervor.session.events import Close


class Outbox:
    """Messages to one client."""

    def __init__(self, wire: Wire, *, most_bytes: int) -> None:
        self._wire = wire
        self._most_bytes = most_bytes
        self._waiting: OrderedDict[Hashable, str | bytes | Close] = OrderedDict()
        self._bytes = 0
        self._something: asyncio.Future[None] | None = None  # while nothing waits: when something does
        self._stuck = False
        self._put = 0
        self.bytes_sent = 0
        self.superseded = 0

    @property
    def full(self) -> bool:
        """Whether the client takes no bytes just now, and more waits for it than may."""
        return self._stuck and self._bytes > self._most_bytes

    def put(self, message: str | bytes | Close, *, topic: Hashable = None) -> None:
        """Send this after everything put before; a `Close` is the last.

        Args:
            message: encoded.
            topic: takes the place of what still waits under the same topic; None for none.
        """
        if not (self._waiting or self._stuck or isinstance(message, Close)) and self._wire.write(message):
            self.bytes_sent += len(message)
            return
        self._put += 1
        key = self._put if topic is None else topic
        old = self._waiting.pop(key, None)
        if old is not None and not isinstance(old, Close):
            self._bytes -= len(old)
            self.superseded += 1
        self._waiting[key] = message
        self._bytes += 0 if isinstance(message, Close) else len(message)
        if self._something is not None and not self._something.done():
            self._something.set_result(None)

    def drop(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
        self._bytes = 0

    async def send_all(self) -> None:
        """Send until a close was sent or the client is gone."""
        try:
            while True:
                while self._waiting:
                    _, message = self._waiting.popitem(last=False)
                    if isinstance(message, Close):
                        await self._wire.close(message.code, message.reason)
                        return
                    self._bytes -= len(message)
                    await self._send(message)
                self._something = asyncio.get_running_loop().create_future()
                await self._something
        except ConnectionError:
            return

    async def _send(self, message: str | bytes) -> None:
        self._stuck = True  # nobody sees it unless the send has to wait
        await self._wire.send(message)
        self._stuck = False
        self.bytes_sent += len(message)
