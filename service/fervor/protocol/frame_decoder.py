"""The messages that come thirty times a second, `frame` and `frames`, decoded without pydantic.

msgspec reads them straight into the types they must have, and is stricter than the plain path of
`fervor.protocol.codec`: it takes a message only if all of it is right. What it does not take, the plain path decodes,
or refuses with a sentence; so one place alone says what is wrong.
"""

from collections.abc import Callable

import msgspec

from fervor.protocol.lean_frame import LeanFrame, LeanFrames, LeanJsonFrame, LeanJsonFrames

_from_json: Callable[[str], LeanFrame | LeanFrames] = msgspec.json.Decoder(LeanJsonFrame | LeanJsonFrames).decode
_from_msgpack: Callable[[bytes], LeanFrame | LeanFrames] = msgspec.msgpack.Decoder(LeanFrame | LeanFrames).decode


def frames_from_json(text: str) -> LeanFrame | LeanFrames | None:
    """The message in a JSON text; None if it is another one, or not surely right."""
    try:
        return _from_json(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None


def frames_from_msgpack(data: bytes) -> LeanFrame | LeanFrames | None:
    """The message in MessagePack; None if it is another one, or not surely right."""
    try:
        return _from_msgpack(data)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None
