"""What waits for a slow reader: in order, bounded, and newest wins where a topic is given."""

from fervor.errors import CloseCode
from fervor.server.outbox import Outbox
from fervor.session.events import Close

CLOSE = Close(CloseCode.NORMAL, "ended")


class Reader:
    """A wire whose client takes so many messages, and then is stuck."""

    def __init__(self, room: int = 0) -> None:
        self.taken: list[object] = []
        self.room = room
        self.stuck = False

    def write(self, message: str | bytes) -> bool:
        return self._take(message)

    def close(self, code: CloseCode, reason: str) -> bool:
        return self._take((code, reason))

    def _take(self, what: object) -> bool:
        self.stuck = not self.room
        if self.stuck:
            return False
        self.room -= 1
        self.taken.append(what)
        return True


def take(reader: Reader, outbox: Outbox, count: int) -> None:
    """The client takes so many messages more."""
    reader.room += count
    outbox.flush()


def test_all_leave_in_order_and_the_close_last() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    for message in ("a", b"bc", "def", CLOSE):
        outbox.put(message)
    assert not outbox.closed
    take(reader, outbox, 3)
    assert reader.taken == ["a", b"bc", "def"]
    assert not outbox.closed
    take(reader, outbox, 1)
    assert reader.taken == ["a", b"bc", "def", (1000, "ended")]
    assert outbox.closed
    assert outbox.bytes_sent == 6


def test_a_newer_message_takes_the_place_of_one_that_waits() -> None:
    reader = Reader(room=1)
    outbox = Outbox(reader, most_bytes=100)
    outbox.put("on its way", topic="a")
    for number in range(1000):
        outbox.put(f"a{number}", topic="a")
        outbox.put(f"b{number}", topic="b")
    outbox.put("kept")
    assert not outbox.full  # a thousand of each came, but one of each waits
    assert outbox.superseded == 2 * 999
    outbox.put(CLOSE)
    take(reader, outbox, 4)
    assert reader.taken == ["on its way", "a999", "b999", "kept", (1000, "ended")]


def test_it_is_full_only_while_the_client_takes_nothing() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    for _ in range(20):
        outbox.put("x" * 10)
    assert outbox.full
    reader.stuck = False  # it takes again, and what waits is about to be sent
    assert not outbox.full
    reader.stuck = True
    outbox.drop()
    assert not outbox.full
    outbox.put(CLOSE)
    take(reader, outbox, 1)
    assert reader.taken == [(1000, "ended")]


def test_what_waits_counts_until_it_leaves() -> None:
    reader = Reader()
    outbox = Outbox(reader, most_bytes=100)
    for _ in range(11):
        outbox.put(b"x" * 10)
    assert outbox.full
    take(reader, outbox, 1)
    assert not outbox.full
    assert reader.stuck
    outbox.put("y")
    assert outbox.full


def test_what_the_wire_takes_at_once_never_waits() -> None:
    reader = Reader(room=3)
    outbox = Outbox(reader, most_bytes=100)
    outbox.put("abc")
    outbox.put("de", topic="t")
    assert reader.taken == ["abc", "de"]
    assert (outbox.bytes_sent, outbox.superseded) == (5, 0)
    outbox.put(CLOSE)
    assert outbox.closed


def test_nothing_overtakes_what_waits() -> None:
    reader = Reader(room=1)
    outbox = Outbox(reader, most_bytes=100)
    outbox.put("first")
    outbox.put("waits")
    reader.room = 10  # there is room again, but the wire has not said so yet
    outbox.put("waits too")
    outbox.put("later")
    outbox.flush()
    outbox.put("last")
    outbox.put(CLOSE)
    assert reader.taken == ["first", "waits", "waits too", "later", "last", (1000, "ended")]
