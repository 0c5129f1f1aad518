"""Signs checkpoints, so that a service takes back only what it, or a replica with the same key, gave out.

A token is base64 of: key id (4 bytes) · time of issue (8 bytes, seconds) · content · HMAC-SHA256 over all before.
Two keys may be valid at once: the first signs, both are believed, so that keys can be rotated without losing a stream.
"""

import base64
import binascii
import hashlib
import hmac
import struct
from binascii import b2a_base64
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from fervor.errors import CheckpointUnknown

_HEAD = struct.Struct("<4sq")
_MAC_BYTES = hashlib.sha256().digest_size


@dataclass(frozen=True, slots=True)
class Sealer:
    """Keys, newest first, and how long a token is good for."""

    keys: Sequence[bytes]
    ttl_s: float

    def seal(self, content: bytes, now: float) -> str:
        """A token for `content`, issued at `now` (seconds, service clock)."""
        key = self.keys[0]
        signed = _HEAD.pack(_key_id(key), int(now)) + content
        return b2a_base64(signed + _mac(key, signed), newline=False).decode()  # the URL's alphabet costs thrice that

    def open(self, token: str, now: float) -> bytes:
        """The content of a token.

        Raises:
            CheckpointUnknown: not one of ours, altered, or too old.
        """
        try:
            raw = base64.b64decode(token, validate=True)
        except (binascii.Error, ValueError):
            raise CheckpointUnknown("the checkpoint is not base64; expected a token as the service sent it") from None
        if len(raw) < _HEAD.size + _MAC_BYTES:
            raise CheckpointUnknown("the checkpoint is too short; expected a token as it was sent")
        signed, mac = raw[:-_MAC_BYTES], raw[-_MAC_BYTES:]
        name, issued = _HEAD.unpack(signed[: _HEAD.size])
        key = next((key for key in self.keys if _key_id(key) == name), None)
        if key is None or not hmac.compare_digest(_mac(key, signed), mac):
            raise CheckpointUnknown("the checkpoint was not signed with a key of this service")
        if now - issued > self.ttl_s:
            raise CheckpointUnknown(f"the checkpoint is {now - issued:.0f} s old; it was good for {self.ttl_s:.0f} s")
        return signed[_HEAD.size :]


@lru_cache(maxsize=8)
def _key_id(key: bytes) -> bytes:
    return hashlib.sha256(b"fervor key id" + key).digest()[:4]


def _mac(key: bytes, signed: bytes) -> bytes:
    return hmac.digest(key, signed, "sha256")
