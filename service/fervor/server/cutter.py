"""WebSocket frames (RFC 6455, section 5.2), without I/O: cuts what a client sends into them, makes those of a server.

Nearly everything a client says is one whole, masked data frame: such a message is unmasked here. All else (control
frames, messages in pieces, frames of which a part is still to come, whatever is wrong) is passed on as it came, a frame
at a time, for a complete parser to judge.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from struct import Struct

from websockets.frames import Opcode

try:
    from websockets.speedups import apply_mask
except ImportError:  # a build without C
    from websockets.utils import apply_mask

FIN = 0x80
MASKED = 0x80
_TEXT, _BINARY = int(FIN | Opcode.TEXT), int(FIN | Opcode.BINARY)
_WHOLE = (_TEXT, _BINARY)
_PIECES = (Opcode.CONT, FIN | Opcode.CONT, Opcode.TEXT, Opcode.BINARY)
_CONTROL = (FIN | Opcode.CLOSE, FIN | Opcode.PING, FIN | Opcode.PONG)

MASK_BYTES = 4
START = 2 + MASK_BYTES
"""Where the payload of a short frame starts."""

SHORT = 126
"""Lengths below stand in the second byte; this one says that two bytes of length follow, the next one that eight do."""


_MEDIUM, _LONG = Struct("!BBH"), Struct("!BBQ")


def whole(data: bytes, most_bytes: int) -> str | bytes | None:
    """The message where these bytes are one of usual size and nothing else, as they mostly are.

    None where they are not, or are no text where they should be: then they are to be `cut`.

    Args:
        data: from the start of a frame on, outside a message in pieces.
        most_bytes: largest message.
    """
    length = len(data)
    if length < START:
        return None
    if data[1] == MASKED | SHORT:
        size, start = data[2] << 8 | data[3], START + 2
    else:
        size, start = data[1] - MASKED, START
        if not 0 <= size < SHORT:  # without a mask it is negative
            return None
    if start + size != length or size > most_bytes:
        return None
    first = data[0]
    if first == _BINARY:
        return apply_mask(data[start:], data[start - MASK_BYTES : start])
    if first != _TEXT:
        return None
    try:
        return apply_mask(data[start:], data[start - MASK_BYTES : start]).decode()
    except UnicodeDecodeError:
        return None


def as_frame(message: str | bytes) -> bytes:
    """A message as a frame of a server: in one, without a mask."""
    first, payload = (_TEXT, message.encode()) if isinstance(message, str) else (_BINARY, message)
    size = len(payload)
    if size < SHORT:
        return bytes((first, size)) + payload
    if size < 65536:
        return _MEDIUM.pack(first, SHORT, size) + payload
    return _LONG.pack(first, SHORT + 1, size) + payload


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

    @property
    def at_rest(self) -> bool:
        """Whether the next byte begins a frame, and not inside a message."""
        return not (self._kept or self._owed or self._in_pieces)

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
                    yield Message(payload, is_text=data[at] == _TEXT)
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
