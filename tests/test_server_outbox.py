"""What waits for a slow reader: in order, bounded, and newest wins where a topic is given."""

import asyncio

from fervor.errors import CloseCode
from fervor.server.outbox import Outbox
from fervor.session.events import Close

CLOSE = Close(CloseCode.NORMAL, "ended")


class Reader:
    """A wire whose client takes a message when told to."""

    def __init__(self) -> None:
        self.taken: list[object] = []
        self.allowed = asyncio.Semaphore(0)
        self.gone = False

    async def receive(self) -> None:
        return None

    def listen(self, take) -> None:
        pass

    def write(self, message: str | bytes) -> bool:
        return False

    async def send(self, message: str | bytes) -> None:
        await self.allowed.acquire()
        if self.gone:
            raise ConnectionError
        self.taken.append(message)

    async def close(self, code: int, reason: str) -> None:
        self.taken.append((code, reason))


async def test_all_leave_in_order_and_the_close_last() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    for message in ("a", b"bc", "def", CLOSE):
        outbox.put(message)
    for _ in range(3):
        reader.allowed.release()
    await outbox.send_all()
    assert reader.taken == ["a", b"bc", "def", (1000, "ended")]
    assert outbox.bytes_sent == 6


async def test_a_newer_message_takes_the_place_of_one_that_waits() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    sending = asyncio.create_task(outbox.send_all())
    outbox.put("on its way", topic="a")
    await asyncio.sleep(0)
    for number in range(1000):
        outbox.put(f"a{number}", topic="a")
        outbox.put(f"b{number}", topic="b")
    outbox.put("kept")
    assert not outbox.full  # a thousand of each came, but one of each waits
    assert outbox.superseded == 2 * 999
    outbox.put(CLOSE)
    for _ in range(4):
        reader.allowed.release()
    await sending
    assert reader.taken == ["on its way", "a999", "b999", "kept", (1000, "ended")]


async def test_it_is_full_only_while_the_client_takes_nothing() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    for _ in range(20):
        outbox.put("x" * 10)
    assert not outbox.full  # nobody has tried yet
    sending = asyncio.create_task(outbox.send_all())
    await asyncio.sleep(0)
    assert outbox.full
    outbox.drop()
    assert not outbox.full
    outbox.put(CLOSE)
    reader.allowed.release()
    await sending
    assert reader.taken[-1] == (1000, "ended")


async def test_a_client_that_is_gone_ends_it_quietly() -> None:
    reader = Reader()
    reader.gone = True
    reader.allowed.release()
    outbox = Outbox(reader, most_bytes=100)
    outbox.put("x")
    await outbox.send_all()
    assert outbox.bytes_sent == 0


class Prompt(Reader):
    """A wire that takes what it can at once, in the same list."""

    def __init__(self, room: int) -> None:
        super().__init__()
        self.room = room

    def write(self, message: str | bytes) -> bool:
        if not self.room:
            return False
        self.room -= 1
        self.taken.append(message)
        return True


async def test_what_the_wire_takes_at_once_never_waits() -> None:
    wire = Prompt(room=2)
    outbox = Outbox(wire, most_bytes=100)
    outbox.put("abc")
    outbox.put("de", topic="t")
    assert wire.taken == ["abc", "de"]
    assert (outbox.bytes_sent, outbox.superseded) == (5, 0)


async def test_nothing_overtakes_what_waits() -> None:
    wire = Prompt(room=1)
    outbox = Outbox(wire, most_bytes=100)
    outbox.put("first")
    outbox.put("waits")
    wire.room = 10  # there is room again, but something waits, and then is on its way
    outbox.put("waits too")
    sending = asyncio.create_task(outbox.send_all())
    await asyncio.sleep(0)
    outbox.put("later")
    for _ in range(3):
        wire.allowed.release()
    outbox.put(CLOSE)
    await sending
    assert wire.taken == ["first", "waits", "waits too", "later", (1000, "ended")]
