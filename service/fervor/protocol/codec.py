"""Bytes to messages and back. One codec per subprotocol; a codec knows nothing of what was said before."""

import json
import re
import reprlib
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

import msgpack
import msgspec
from pydantic import TypeAdapter, ValidationError

from fervor.errors import FrameError, MessageError
from fervor.protocol.frame_decoder import frames_from_json, frames_from_msgpack
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import PROTOCOL, ClientMessage, ServerMessage

_CLIENT: TypeAdapter[ClientMessage] = TypeAdapter(ClientMessage)
_SERVER: TypeAdapter[ServerMessage] = TypeAdapter(ServerMessage)


_pack: Callable[[object], bytes] = msgspec.msgpack.Encoder().encode
_write: Callable[[object], bytes] = msgspec.json.Encoder().encode

_LEAN = (LeanEstimate, LeanEstimates)
"""What msgspec encodes as it is; a union would cost a frame more than its encoding."""

_Message = TypeVar("_Message")


class Codec(Protocol):
    """One encoding of the protocol."""

    subprotocol: str
    """As negotiated in Sec-WebSocket-Protocol."""

    def decode_client(self, data: str | bytes) -> ClientMessage:
        """A message from the client; raises MessageError."""

    def decode_frames(self, data: str | bytes) -> LeanFrame | LeanFrames | None:
        """Frames, for who takes many at once; None where it is any other message, or not surely right."""

    def decode_server(self, data: str | bytes) -> ServerMessage:
        """A message from the service; raises MessageError."""

    def encode(self, message: ClientMessage | ServerMessage | LeanEstimate | LeanEstimates) -> str | bytes:
        """The message as one WebSocket frame's payload."""


class JsonCodec:
    """`fervor.v1.json`: one JSON object a text frame."""

    subprotocol = f"{PROTOCOL}.json"

    def decode_client(self, data: str | bytes) -> ClientMessage:
        """A message from the client; raises MessageError saying which field is wrong and what was expected."""
        lean = self.decode_frames(data)
        return self._decode(_CLIENT, data) if lean is None else lean.to_message()

    def decode_frames(self, data: str | bytes) -> LeanFrame | LeanFrames | None:
        """See `Codec`."""
        return frames_from_json(data) if isinstance(data, str) else None

    def decode_server(self, data: str | bytes) -> ServerMessage:
        """A message from the service; raises MessageError."""
        return self._decode(_SERVER, data)

    def encode(self, message: ClientMessage | ServerMessage | LeanEstimate | LeanEstimates) -> str:
        """The message as JSON text; fields that say nothing are left out."""
        if isinstance(message, _LEAN):
            return _write(message).decode()
        return message.model_dump_json(exclude_none=message.type not in KEEP_NULLS)

    @staticmethod
    def _decode(adapter: TypeAdapter[_Message], data: str | bytes) -> _Message:
        if isinstance(data, bytes):
            raise MessageError(f"{JsonCodec.subprotocol} takes text messages, but {len(data)} bytes of binary came")
        try:
            return adapter.validate_json(data, strict=True)
        except ValidationError as error:
            raise _refusal(error, _parsed(data)) from None


class MsgpackCodec:
    """`fervor.v1.msgpack`: one MessagePack map a binary frame; the joints of frames may be raw float32."""

    subprotocol = f"{PROTOCOL}.msgpack"

    def decode_client(self, data: str | bytes) -> ClientMessage:
        """A message from the client; raises MessageError saying which field is wrong and what was expected."""
        lean = self.decode_frames(data)
        return self._decode(_CLIENT, data) if lean is None else lean.to_message()

    def decode_frames(self, data: str | bytes) -> LeanFrame | LeanFrames | None:
        """See `Codec`."""
        return None if isinstance(data, str) else frames_from_msgpack(data)

    def decode_server(self, data: str | bytes) -> ServerMessage:
        """A message from the service; raises MessageError."""
        return self._decode(_SERVER, data)

    def encode(self, message: ClientMessage | ServerMessage | LeanEstimate | LeanEstimates) -> bytes:
        """The message as MessagePack; fields that say nothing are left out."""
        if isinstance(message, _LEAN):
            return _pack(message)
        return _pack(message.model_dump(exclude_none=message.type not in KEEP_NULLS))

    @staticmethod
    def _decode(adapter: TypeAdapter[_Message], data: str | bytes) -> _Message:
        if isinstance(data, str):
            raise MessageError(
                f"{MsgpackCodec.subprotocol} takes binary messages, but {len(data)} characters of text came"
            )
        try:
            unpacked = msgpack.unpackb(data, use_list=False)
        except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
            raise MessageError(f"the message is not MessagePack: {error or type(error).__name__}") from None
        try:
            return adapter.validate_python(unpacked)
        except ValidationError as error:
            raise _refusal(error, unpacked) from None


KEEP_NULLS = frozenset({"estimate", "estimates", "frame", "frames"})
"""Messages in which null means something: no intensity yet, a joint not tracked."""

CODECS: Mapping[str, Codec] = {codec.subprotocol: codec for codec in (JsonCodec(), MsgpackCodec())}
"""All codecs by subprotocol."""


def one_sentence(error: ValidationError) -> str:
    """The first complaint of a pydantic error as one sentence: where, what, and what came."""
    first = error.errors(include_url=False, include_context=False)[0]
    problem = first["msg"].removeprefix("Value error, ")
    if first["type"] == "json_invalid":
        return f"the message is not JSON: {problem.removeprefix('Invalid JSON: ')}"
    place = _place(first["loc"])
    if first["type"] == "extra_forbidden":
        return f"{place} is not a field of this message"
    if first["type"] == "missing":
        return f"{place} is missing"
    if first["type"].startswith("union_tag"):
        return f"the message's type is not known: {problem}"
    came = first["input"]
    shown = reprlib.repr(came) if isinstance(came, dict | list | tuple) else repr(came)  # a container may be huge
    return f"{place}: {problem[0].lower()}{problem[1:]}, but {shown if len(shown) <= 60 else shown[:57] + '...'} came"


def _parsed(data: str) -> object:
    """The JSON of a message that was refused; None where it is none."""
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return None


def _refusal(error: ValidationError, message: object) -> MessageError:
    """Why a message is refused; of a frame it names body and seq, where those can be read."""
    sentence = one_sentence(error)
    if not isinstance(message, dict) or message.get("type") != "frame":
        return MessageError(sentence)
    body, seq = message.get("body", "0"), message.get("seq")
    if not isinstance(body, str) or not 1 <= len(body) <= 64 or type(seq) is not int or not 0 <= seq <= 2**53:
        return MessageError(sentence)
    return FrameError(f"frame {seq} of body {body!r}: {sentence}", body=body, seq=seq)


def _place(loc: tuple[int | str, ...]) -> str:
    parts = [str(part) for part in loc if not re.match(r"^(tuple|dict|str|function|constrained)\b", str(part))]
    return ".".join(parts) or "the message"
