"""What sessions send: every byte of a run, made before it.

All sessions of a variant send the same messages, masked and framed once, so that the generator only has to hand bytes
to the kernel. Frames are numbered through a session: frame n is picture n // bodies of body n % bodies, and message m
holds the frames from m · frames_per_message on.

Times in the frames are a sensor's: they begin anywhere, and every one is off by up to `jitter_s`. So the service has to
put poses on its grid by SLERP, and a frame brings no step of it, one, or two.
"""

import base64
import json
import math
import secrets
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, Literal

import msgpack
import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import PROTOCOL
from fervor.skeletons.catalog import SKELETONS
from fervor_bench.errors import BenchError

Encoding = Literal["json", "msgpack"]

CYCLE = 300
"""Frames after which the motion repeats: 10 s."""

MASK_KEY = b"\x37\xfa\x21\x3d"
"""As in RFC 6455's example; nobody in between could be fooled by foreseen bytes here."""

HEAD = struct.Struct("<6Id")
"""Variants, messages a variant, frames a message, bodies, sizes of request and start, Hz: see load.c."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """What one session sends."""

    encoding: Encoding = "msgpack"
    joints: int = 13
    bodies: int = 1
    frames_per_message: int = 1
    rate_hz: float = 30.0
    """Frames a second of each body."""
    jitter_s: float = 0.004
    """How far a frame's time may be off, either way, seconds; 0: none is, which spares the service the SLERP."""
    checkpoints: bool = True
    """One a second and body."""
    emotion: str = "joy"

    def __post_init__(self) -> None:
        few, many = sorted((self.bodies, self.frames_per_message))
        if many % few:
            raise BenchError(
                f"{self.frames_per_message} frames in a message do not go with {self.bodies} bodies; "
                "expected one to be a multiple of the other"
            )
        if not 0.0 <= self.jitter_s < 0.5 / self.rate_hz:
            raise BenchError(
                f"times that are off by {1000 * self.jitter_s:g} ms may not rise; "
                f"expected 0 or more, and less than {500 / self.rate_hz:.3g}"
            )

    @property
    def skeleton(self) -> str:
        """The first skeleton of the catalog with so many joints that sends xyzw."""
        for name, known in SKELETONS.items():
            if len(known.joints) == self.joints and known.quaternion == "xyzw":
                return name
        counts = sorted({len(known.joints) for known in SKELETONS.values() if known.quaternion == "xyzw"})
        raise BenchError(f"no skeleton has {self.joints} joints; expected one of {', '.join(map(str, counts))}")

    @property
    def messages_per_turn(self) -> int:
        """Messages of a session that are due together."""
        return max(self.bodies // self.frames_per_message, 1)

    @property
    def pictures_per_turn(self) -> int:
        """Pictures of the sensor in them."""
        return max(self.frames_per_message // self.bodies, 1)

    @property
    def subprotocol(self) -> str:
        """As asked for in the handshake."""
        return f"{PROTOCOL}.{self.encoding}"

    def start(self) -> Mapping[str, Any]:
        """The `session.start`."""
        extra = {"checkpoint_s": 1.0} if self.checkpoints else {}
        return {"type": "session.start", "skeleton": self.skeleton, "emotion": self.emotion, **extra}

    def motion(self, variant: int) -> npt.NDArray[np.float32]:
        """Unit quaternions [frame, joint, 4] of a smooth motion, one cycle."""
        random = np.random.default_rng(variant)
        turns = random.integers(1, 8, (self.joints, 3))  # whole ones a cycle
        phase, swing = random.uniform(0, 2 * math.pi, (self.joints, 3)), random.uniform(0.05, 0.4, (self.joints, 3))
        time = 2 * math.pi * np.arange(CYCLE)[:, None, None] / CYCLE
        vector = swing * np.sin(turns * time + phase)  # [frame, joint, 3]
        q = np.concatenate([vector, np.ones((CYCLE, self.joints, 1))], axis=-1)
        return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True), np.float32).round(6)

    def times(self, variant: int, pictures: int) -> npt.NDArray[np.float64]:
        """The times of the first pictures, seconds on the sensor's clock: [picture]; whole microseconds, or exact."""
        random = np.random.default_rng((variant, 1))
        begin = random.uniform(1.0, 10.0) if self.jitter_s else 0.0
        jitter = random.uniform(-self.jitter_s, self.jitter_s, pictures)
        times: npt.NDArray[np.float64] = begin + np.arange(pictures) / self.rate_hz + jitter
        return times.round(6) if self.jitter_s else times

    def payloads(self, variant: int, messages: int) -> Iterator[bytes]:
        """The messages in order, as they are before framing."""
        pictures = -(-messages * self.frames_per_message // self.bodies)
        parts = _FrameWriter(self, self.motion(variant), self.times(variant, pictures))
        for message in range(messages):
            first = message * self.frames_per_message
            yield parts.message(range(first, first + self.frames_per_message))

    def encode(self, message: Mapping[str, Any]) -> bytes:
        """Any other message."""
        if self.encoding == "json":
            return json.dumps(message).encode()
        packed: bytes = msgpack.packb(message)
        return packed

    def write(self, path: Path, *, address: str, target: str, variants: int, messages: int, token: str = "") -> None:
        """Write the generator's script.

        Args:
            path: of the script.
            address: HOST:PORT, for the handshake.
            target: path of the stream on the service.
            variants: how many different motions; session n sends variant n % variants.
            messages: of each variant.
            token: bearer token of the service, if it wants one.
        """
        request = self._request(address, target, token)
        start = framed(self.encode(self.start()), text=self.encoding == "json")
        shape = (variants, messages, self.frames_per_message, self.bodies, len(request), len(start))
        offsets = np.zeros(variants * messages + 1, "<u8")
        with path.open("wb") as file:
            file.write(HEAD.pack(*shape, self.rate_hz))
            table = file.tell()
            file.write(offsets.tobytes())
            file.write(request + start)
            self._write_messages(file, offsets, variants, messages)
            file.seek(table)
            file.write(offsets.tobytes())

    def _write_messages(self, file: IO[bytes], offsets: npt.NDArray[np.uint64], variants: int, messages: int) -> None:
        at, place = 0, 0
        for variant in range(variants):
            for payload in self.payloads(variant, messages):
                at += file.write(framed(payload, text=self.encoding == "json"))
                place += 1
                offsets[place] = at

    def _request(self, address: str, target: str, token: str) -> bytes:
        lines = [
            f"GET {target} HTTP/1.1",
            f"Host: {address}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            f"Sec-WebSocket-Key: {base64.b64encode(secrets.token_bytes(16)).decode()}",
            "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Protocol: {self.subprotocol}",
            *([f"Authorization: Bearer {token}"] if token else []),
        ]
        return ("\r\n".join(lines) + "\r\n\r\n").encode()


class _FrameWriter:
    """Writes frames of one motion; what does not change from cycle to cycle is encoded once."""

    def __init__(self, traffic: Traffic, motion: npt.NDArray[np.float32], times: npt.NDArray[np.float64]) -> None:
        self._traffic = traffic
        self._times = times.tolist()
        self._json = traffic.encoding == "json"
        if self._json:
            self._poses = [json.dumps(_shorter(pose), separators=(",", ":")).encode() for pose in motion]
        else:
            self._poses = [msgpack.packb(pose.astype("<f4").tobytes()) for pose in motion]

    def message(self, numbers: Sequence[int]) -> bytes:
        """The message of these frames of the session."""
        frames = [self._frame(number) for number in numbers]
        if len(frames) == 1:
            return frames[0]
        if self._json:
            return b'{"type":"frames","frames":[' + b",".join(frames) + b"]}"
        return b"\x82\xa4type\xa6frames\xa6frames" + _array_head(len(frames)) + b"".join(frames)

    def _frame(self, number: int) -> bytes:
        picture, body = divmod(number, self._traffic.bodies)
        t = self._times[picture]
        pose = self._poses[picture % CYCLE]
        if self._json:
            return b'{"type":"frame","body":"%d","seq":%d,"t":%.6f,"q":%b}' % (body, number, t, pose)
        head = b"\x85\xa4type\xa5frame\xa4body" + bytes(msgpack.packb(str(body))) + b"\xa3seq"
        return head + bytes(msgpack.packb(number)) + b"\xa1t\xcb" + struct.pack(">d", t) + b"\xa1q" + pose


def framed(payload: bytes, *, text: bool) -> bytes:
    """A payload as one masked WebSocket frame."""
    size = len(payload)
    head = bytes([0x81 if text else 0x82])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 65536:
        head += struct.pack(">BH", 0x80 | 126, size)
    else:
        head += struct.pack(">BQ", 0x80 | 127, size)
    return head + MASK_KEY + (np.frombuffer(payload, np.uint8) ^ _mask(size)).tobytes()


@lru_cache(maxsize=256)
def _mask(size: int) -> npt.NDArray[np.uint8]:
    """The key, repeated; messages of a run have few sizes, and most of the time to frame one would go here."""
    return np.resize(np.frombuffer(MASK_KEY, np.uint8), size)


def _shorter(pose: npt.NDArray[np.float32]) -> list[list[float]]:
    """As a client would write it: six decimals."""
    return [[round(value, 6) for value in joint] for joint in pose.astype(np.float64).tolist()]


def _array_head(count: int) -> bytes:
    return bytes([0x90 | count]) if count < 16 else b"\xdc" + struct.pack(">H", count)
