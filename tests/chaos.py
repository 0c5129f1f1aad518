"""A network that fails as networks do, by a seeded plan: a TCP proxy in front of services that come and go."""

import asyncio
import random
import socket
import struct
import threading
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress

FATES = {
    "goes on": 3,
    "resets": 4,  # RST in mid-message
    "ends": 4,  # FIN in mid-message
    "falls silent": 1,  # half-open: nobody hears anything any more, and nobody is told
    "dawdles": 2,  # every chunk comes late
    "trickles": 2,  # few bytes at a time
    "refuses": 1,
}
"""What becomes of a connection, and how often of so many."""

NOTICED_AT_ONCE = {fate: often for fate, often in FATES.items() if fate != "falls silent"}
"""Without the one that a client can notice by its patience only."""

CHUNK = 16_384
TRICKLE = 1500  # bytes


class Proxy:
    """Carries connections to the targets in turn, so that sessions hop between them; runs in a thread of its own."""

    def __init__(self, seed: int, *, lives: tuple[int, int], fates: Mapping[str, int] = FATES) -> None:
        """`lives`: bytes that a doomed connection carries, at least and at most."""
        self.targets: list[int] = []
        self.met: Counter[str] = Counter()
        self._dice = random.Random(seed)
        self._lives = lives
        self._fates = fates
        self._turn = 0
        self._loop = asyncio.new_event_loop()
        self._open: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._server = self._do(asyncio.start_server(self._carry, "127.0.0.1", 0))
        self.url = f"ws://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    def close(self) -> None:
        self._do(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _do(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result()

    async def _end(self) -> None:
        self._server.close()
        for task in self._open:
            task.cancel()
        await asyncio.gather(*self._open, return_exceptions=True)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._open.add(task)
        fate = self._dice.choices(list(self._fates), list(self._fates.values()))[0]
        life = self._dice.randint(*self._lives)
        self._turn += 1
        others: tuple[asyncio.StreamWriter, ...] = ()
        try:
            with suppress(OSError):
                if fate == "refuses":
                    self.met[fate] += 1
                    return
                upstream, service = await asyncio.open_connection("127.0.0.1", self.targets[self._turn % 2])
                others = (service,)
                line = _Line(fate, life, self.met)
                ways = [line.pass_on(reader, service), line.pass_on(upstream, writer)]
                tasks = [asyncio.ensure_future(way) for way in ways]
                try:
                    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                finally:
                    for each in tasks:
                        each.cancel()
                    await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            for end in (writer, *others):
                if fate == "resets":
                    with suppress(OSError):
                        end.get_extra_info("socket").setsockopt(
                            socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)
                        )
                end.close()
            self._open.discard(task)


class _Line:
    """One connection, and what it still has to live."""

    def __init__(self, fate: str, life: int, met: Counter[str]) -> None:
        self._fate = fate
        self._left = life
        self._met = met
        self._silent = False

    async def pass_on(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        """Until the source ends, or the line does, wherever that is in a message."""
        while chunk := await source.read(TRICKLE if self._fate == "trickles" else CHUNK):
            if self._silent:
                continue
            self._left -= len(chunk)
            if self._left < 0 and self._fate in ("resets", "ends", "falls silent"):
                sink.write(chunk[: self._left])
                self._met[self._fate] += 1
                if self._fate != "falls silent":
                    await sink.drain()
                    return
                self._silent = True
                continue
            if self._fate in ("dawdles", "trickles") and self._left > 0:  # not for ever: the test is to end
                await asyncio.sleep(0.02 if self._fate == "dawdles" else 0.001)
            elif self._left < 0:
                self._met[self._fate] += 1
                self._left = 1 << 60
            sink.write(chunk)
            await sink.drain()
