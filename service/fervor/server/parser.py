"""All that a client sends but whole messages: control frames, messages in pieces, what is wrong. Without I/O.

Whole messages among it are cut out; the rest is websockets' to judge and to answer.
"""

from collections.abc import Iterator

from websockets.frames import CloseCode, Frame, Opcode
from websockets.protocol import OPEN
from websockets.server import ServerProtocol

from fervor.server.cutter import Cutter

PIECE = 4096
"""Bytes that are read in one go; so many small frames at most come between two looks at the pace."""


class Parser:
    """The frames of one client, from the start of a frame on."""

    def __init__(self, *, most_bytes: int) -> None:
        """Begin.

        Args:
            most_bytes: largest message.
        """
        self._cutter = Cutter(most_bytes=most_bytes)
        self._protocol = ServerProtocol(state=OPEN, max_size=most_bytes)
        self._protocol.debug = False  # it would log what clients say
        self._pieces: list[bytes] = []
        self._is_text = False
        self.complaint: str | None = None
        """What was wrong, where only the service's operator can be told."""

    @property
    def open(self) -> bool:
        """Whether no side has closed yet."""
        return self._protocol.state is OPEN

    @property
    def at_rest(self) -> bool:
        """Whether nothing was left unfinished, so that another parser could go on."""
        return self.open and not self._pieces and self._cutter.at_rest

    @property
    def ends(self) -> bool:
        """Whether nothing is said any more, once the answer was sent."""
        return self._protocol.eof_sent

    @property
    def agreed(self) -> bool:
        """Whether the client closed, or answered a close: then nothing of it is still under way."""
        return self._protocol.close_rcvd is not None and self._protocol.parser_exc is None

    def feed(self, data: bytes) -> Iterator[str | bytes | Frame]:
        """Messages, and the control frames and later pieces of messages between them; to be used up.

        Text that is none ends the conversation, as everything does that is wrong.
        """
        for part in self._cutter.cut(data):
            if isinstance(part, bytes):
                yield from self._judge(part)
            elif self.open:
                yield from self._message(part.payload, is_text=part.is_text)

    def close(self, code: int, reason: str = "") -> None:
        """Close; the answer to it is to come."""
        if self.open:
            self._protocol.send_close(code, reason)

    def fail(self, code: int, reason: str = "") -> None:
        """Close without waiting for an answer."""
        self._protocol.fail(code, reason)
        self._pieces.clear()

    def answer(self) -> bytes:
        """What is to be sent, if anything."""
        return b"".join(self._protocol.data_to_send())

    def _judge(self, data: bytes) -> Iterator[str | bytes | Frame]:
        for start in range(0, len(data), PIECE):
            if self.ends:
                return
            self._protocol.receive_data(data[start : start + PIECE])
            for frame in self._protocol.events_received():
                assert isinstance(frame, Frame)  # the handshake is over
                if frame.opcode not in (Opcode.TEXT, Opcode.BINARY):
                    yield frame
                if frame.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
                    yield from self._piece(frame)

    def _piece(self, frame: Frame) -> Iterator[str | bytes]:
        if frame.opcode is not Opcode.CONT:
            self._is_text = frame.opcode is Opcode.TEXT
        self._pieces.append(bytes(frame.data))
        if frame.fin:
            whole = b"".join(self._pieces)
            self._pieces.clear()
            yield from self._message(whole, is_text=self._is_text)

    def _message(self, payload: bytes, *, is_text: bool) -> Iterator[str | bytes]:
        try:
            yield payload.decode() if is_text else payload
        except UnicodeDecodeError:
            self.complaint = "a client's text was not UTF-8"
            self.fail(CloseCode.INVALID_DATA)
