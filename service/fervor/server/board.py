"""What the workers of a service show each other: memory that all of them share, with a place for each.

Rules. Only the worker that stands at a place writes there; the supervisor clears it when that worker is gone. There is
no lock, so that a worker killed while it writes holds up nobody: what is new goes into the half that is not shown, and
then one byte, written at once, turns to it. Memory without a name or a file: a read-only container has room for it.
"""

import mmap
import struct
import zlib
from time import monotonic

from fervor.server.shares import Shares

HALF_BYTES = 1 << 20
"""Most that a worker can show; pages that were never written take no memory."""

_STAMP = struct.Struct("!d")  # when it was last written, monotonic seconds, which all processes of a machine share
_HEAD = struct.Struct("!II")  # length, checksum
_PLACE_BYTES = _STAMP.size + 1 + 2 * HALF_BYTES
_NOTHING, _FIRST, _SECOND = 0, 1, 2


class Board:
    """The places of a service's workers, and whether the whole service stops."""

    def __init__(self, places: int) -> None:
        self.places = places
        self.shares = Shares(places)
        self._memory = mmap.mmap(-1, 1 + places * _PLACE_BYTES)

    @property
    def stopping(self) -> bool:
        """Whether all workers leave, and none is left to take new connections."""
        return bool(self._memory[0])

    def stop(self) -> None:
        """Say that all leave."""
        self._memory[0] = 1

    def show(self, place: int, content: bytes) -> None:
        """Put up what stands at a place from now on; what is too large is not put up."""
        start = self._start(place)
        self._memory[start - _STAMP.size : start] = _STAMP.pack(monotonic())
        if len(content) > HALF_BYTES - _HEAD.size:
            return
        turn = _SECOND if self._memory[start] == _FIRST else _FIRST
        half = self._half(place, turn)
        self._memory[half : half + _HEAD.size] = _HEAD.pack(len(content), zlib.crc32(content))
        self._memory[half + _HEAD.size : half + _HEAD.size + len(content)] = content
        self._memory[start] = turn

    def read(self, place: int) -> bytes | None:
        """What stands at a place, or None where nothing does."""
        turn = self._memory[self._start(place)]
        if turn == _NOTHING:
            return None
        half = self._half(place, turn)
        length, checksum = _HEAD.unpack(self._memory[half : half + _HEAD.size])
        content = self._memory[half + _HEAD.size : half + _HEAD.size + length]
        # Two writes while this one read took place would show; nobody writes so often, so this is for a broken writer.
        return content if zlib.crc32(content) == checksum else None

    def age(self, place: int) -> float:
        """Seconds since something was last shown at a place."""
        start = self._start(place)
        (stamp,) = _STAMP.unpack(self._memory[start - _STAMP.size : start])
        return monotonic() - float(stamp)

    def clear(self, place: int) -> None:
        """Nobody stands at a place any more."""
        self._memory[self._start(place)] = _NOTHING
        self.shares.withdraw(place)

    def _start(self, place: int) -> int:
        """Where the byte is that says which half is shown; the stamp stands before it."""
        assert 0 <= place < self.places
        return 1 + place * _PLACE_BYTES + _STAMP.size

    def _half(self, place: int, turn: int) -> int:
        return self._start(place) + 1 + (turn - 1) * HALF_BYTES
