"""Cuts what a client sends into WebSocket frames (RFC 6455, section 5.2), without I/O.

Nearly everything a client says is one whole, masked data frame: such a message is unmasked here. All else (control
frames, messages in pieces, frames of which a part is still to come, whatever is wrong) is passed on as it came, a frame
at a time, for a complete parser to judge.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

from websockets.frames import Opcode

try:
    from websockets.speedups import apply_mask
except ImportError:  # a build without C
    from websockets.utils import apply_mask

FIN = 0x80
MASKED = 0x80
_WHOLE = (FIN | Opcode.TEXT, FIN | Opcode.BINARY)
_PIECES = (Opcode.CONT, FIN | Opcode.CONT, Opcode.TEXT, Opcode.BINARY)
_CONTROL = (FIN | Opcode.CLOSE, FIN | Opcode.PING, FIN | Opcode.PONG)

MASK_BYTES = 4
SHORT = 126
"""Lengths below stand in the second byte; this one says that two bytes of length follow, the next one that eight do."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message that came in one frame."""

    payload: bytes
    is_text: bool


class Cutter:
    """The stream of one client."""

    def __init__(self, *, most_bytes: int) -> None:
        """Begin at the start of a frame.

        Args:
            most_bytes: largest message that is unmasked here.
        """
        self._most = most_bytes
        self._kept = b""  # the start of a frame whose length is still to come
        self._owed = 0.0  # bytes of the frame being passed on that are still to come
        self._in_pieces = False  # between the first and the last piece of a message

    def whole(self, data: bytes) -> bytes | None:
        """The payload where these bytes are one binary message of usual size and nothing else, as they mostly are.

        None, having done nothing, where they are not: then they are to be `cut`.
        """
        if len(data) < 2 or data[0] != _WHOLE[1] or self._kept or self._owed or self._in_pieces:
            return None
        size, start = data[1] - MASKED, 2 + MASK_BYTES  # of a frame without a mask: negative
        if not 0 <= size <= SHORT:
            return None
        if size == SHORT:
            size, start = int.from_bytes(data[2:4], "big"), 4 + MASK_BYTES
        if start + size != len(data) or size > self._most:
            return None
        return apply_mask(data[start:], data[start - MASK_BYTES : start])

    def cut(self, data: bytes) -> Iterator[Message | bytes]:
        """Messages and, as bytes, everything that is not one; what is passed on never spans two frames that are valid.

        The iterator is to be used up before the next call.
        """
        if self._kept:
            data, self._kept = self._kept + data, b""
        at, end = 0, len(data)
        while at < end:
            if not self._owed:
                header = _header(data, at)
                if header is None:
                    self._kept = data[at:]
                    return
                start, size = header
                if size <= self._most and start + size <= end and self._is_message(data[at]):
                    stop = start + int(size)
                    payload = apply_mask(data[start:stop], data[start - MASK_BYTES : start])
                    yield Message(payload, is_text=data[at] == _WHOLE[0])
                    at = stop
                    continue
                self._note(data[at])
                self._owed = start - at + size
            part = data[at : at + int(min(self._owed, end - at))]
            self._owed -= len(part)
            at += len(part)
            yield part

    def _is_message(self, first: int) -> bool:
        return first in _WHOLE and not self._in_pieces

    def _note(self, first: int) -> None:
        if first in _PIECES:
            self._in_pieces = first != FIN | Opcode.CONT


def _header(data: bytes, at: int) -> tuple[int, float] | None:
    """Where the payload of the frame at `at` starts, and its size; None if too little of it came.

    The size of what no client may send is infinite: there is no telling where the next frame would begin.
    """
    if len(data) - at < 2:
        return None
    first, size = data[at], data[at + 1] & ~MASKED
    start = at + 2 + MASK_BYTES
    valid = first in _WHOLE or first in _PIECES or (first in _CONTROL and size < SHORT)
    if not valid or not data[at + 1] & MASKED:
        return start, inf
    if size < SHORT:
        return start, size
    width = 2 if size == SHORT else 8
    if len(data) - at < 2 + width:
        return None
    return start + width, int.from_bytes(data[at + 2 : at + 2 + width], "big")
