"""Plays golden transcripts (clients/transcripts) against a real service, and records them.

    python tests/transcripts.py clients/transcripts/*.jsonl

records: client lines stay, what the service said is written anew.
"""

import asyncio
import json
import struct
import sys
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import msgpack
import websockets

from live import Live, running

FOLDER = Path(__file__).resolve().parents[1] / "clients" / "transcripts"
NEAR = 1e-6

Line = dict[str, Any]


def load(path: Path) -> list[Line]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def save(path: Path, lines: list[Line]) -> None:
    path.write_text("".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines))


def differs(expected: Any, came: Any, names: dict[str, Any], place: str = "") -> str | None:
    """Where what came is not what a transcript expects; names in it take what stands there."""
    if isinstance(expected, str) and expected.startswith("${"):
        names[expected] = came
        return None if came else f"{place} is empty"
    if isinstance(expected, dict) and isinstance(came, dict) and expected.keys() == came.keys():
        return next(filter(None, (differs(expected[k], came[k], names, f"{place}.{k}") for k in expected)), None)
    if isinstance(expected, list) and isinstance(came, list) and len(expected) == len(came):
        pairs = enumerate(zip(expected, came, strict=True))
        return next(filter(None, (differs(one, other, names, f"{place}.{k}") for k, (one, other) in pairs)), None)
    if isinstance(expected, float) and isinstance(came, float) and abs(expected - came) <= NEAR:
        return None
    if place.endswith((".message", ".reason")) and isinstance(came, str) and came:
        return None  # sentences for people may change
    return None if expected == came and type(expected) is type(came) else f"{place} is {came!r}, not {expected!r}"


def filled(value: Any, names: dict[str, Any]) -> Any:
    """A client's message with what the service gave before in place of its name."""
    if isinstance(value, dict):
        return {key: filled(each, names) for key, each in value.items()}
    if isinstance(value, list):
        return [filled(each, names) for each in value]
    return names.get(value, value) if isinstance(value, str) else value


def anonymous(expected: Any, came: Any) -> Any:
    """What came, as a transcript keeps it: under the names that it had there."""
    if isinstance(expected, str) and expected.startswith("${"):
        return expected
    if isinstance(came, dict):
        known = expected if isinstance(expected, dict) else {}
        return {key: anonymous(known.get(key, _NAMES.get(key)), each) for key, each in came.items()}
    if isinstance(came, list):
        known = expected if isinstance(expected, list) and len(expected) == len(came) else [None] * len(came)
        return [anonymous(one, each) for one, each in zip(known, came, strict=True)]
    return came


_NAMES = {
    "session_id": "${session}",
    "model": "${model}",
    "limits": "${limits}",
    "fingerprint": "${fingerprint}",
    "token": "${token}",
}


class Player:
    """One transcript and the service it is played against."""

    def __init__(self, lines: list[Line], *, record: bool = False) -> None:
        self.lines = lines
        self.record = record
        self.names: dict[str, Any] = {}
        self._services = ExitStack()
        self._settings = lines[0]["settings"]
        self._socket: Any = None
        self._stopping: threading.Thread | None = None

    async def play(self) -> list[Line]:
        """Play it; the lines, as recorded. Raises AssertionError where the service says something else."""
        with self._services:
            self._live: Live = self._services.enter_context(running(**self._settings))
            for number, line in enumerate(self.lines[1:], 2):
                try:
                    async with asyncio.timeout(30):
                        self.lines[number - 1] = await self._line(line)
                except (AssertionError, TimeoutError, websockets.ConnectionClosed) as error:
                    raise AssertionError(f"line {number}: {line}: {error!r}") from error
            if self._stopping is not None:
                await asyncio.to_thread(self._stopping.join)
        return self.lines

    async def _line(self, line: Line) -> Line:
        kind = next(iter(line))
        return await getattr(self, f"_{kind}")(line)

    async def _connect(self, line: Line) -> Line:
        asked, headers = line["connect"], {}
        if "authorization" in asked:
            headers["Authorization"] = asked["authorization"]
        try:
            self._socket = await websockets.connect(
                self._live.stream,
                subprotocols=asked.get("subprotocols"),
                additional_headers=headers,
                compression=None,
                max_size=None,
            )
            result = {"accepted": self._socket.subprotocol}
        except websockets.InvalidStatus as refusal:
            after = refusal.response.headers.get("Retry-After")
            refused = {"status": refusal.response.status_code, "code": json.loads(refusal.response.body)["code"]}
            result = {"refused": refused | ({} if after is None else {"retry_after": int(after)})}
        return self._checked(line, {"connect": asked, **result})

    async def _client(self, line: Line) -> Line:
        message = filled(line["client"], self.names)
        if self._packs:
            data = _packed(message)
            await self._socket.send(data)
            return self._checked(line, {"client": line["client"], "hex": data.hex()})
        for _ in range(line.get("times", 1)):
            await self._socket.send(json.dumps(message))
        return line

    async def _client_text(self, line: Line) -> Line:
        await self._socket.send(line["client_text"] * line.get("times", 1))
        return line

    async def _client_text_hex(self, line: Line) -> Line:
        await self._socket.send(bytes.fromhex(line["client_text_hex"]), text=True)
        return line

    async def _client_hex(self, line: Line) -> Line:
        await self._socket.send(bytes.fromhex(line["client_hex"]))
        return line

    async def _server(self, line: Line) -> Line:
        data = await self._socket.recv()
        came = msgpack.unpackb(data) if isinstance(data, bytes) else json.loads(data)
        if self.record:
            kept = anonymous(line["server"], came)
            differs(kept, came, self.names)
            shown = {"hex": data.hex()} if isinstance(data, bytes) and kept == came else {}
            return {"server": kept, **shown}
        wrong = differs(line["server"], came, self.names)
        assert wrong is None, wrong
        return line

    async def _closed(self, line: Line) -> Line:
        with suppress(websockets.ConnectionClosed):
            extra = await self._socket.recv()
            raise AssertionError(f"the service says {extra!r:.300}")
        return self._checked(line, {"closed": self._socket.close_code})

    async def _cut(self, line: Line) -> Line:
        self._socket.transport.abort()
        return line

    async def _service(self, line: Line) -> Line:
        if line["service"] == "stops":
            self._stopping = threading.Thread(target=self._live.stop)
            self._stopping.start()
        else:
            assert line["service"] == "another one"
            if self._stopping is not None:
                await asyncio.to_thread(self._stopping.join)
                self._stopping = None
            self._live = self._services.enter_context(running(**self._settings))
        return line

    def _checked(self, line: Line, came: Line) -> Line:
        assert self.record or line == came, f"it is {came}"
        return came

    @property
    def _packs(self) -> bool:
        return bool(self._socket.subprotocol and self._socket.subprotocol.endswith("msgpack"))


def _packed(message: Any) -> bytes:
    """As MessagePack; raw joints stand in transcripts as {"float32": [numbers]}."""

    def joints(value: Any) -> Any:
        if isinstance(value, dict) and value.keys() == {"float32"}:
            return struct.pack(f"<{len(value['float32'])}f", *value["float32"])
        if isinstance(value, dict):
            return {key: joints(each) for key, each in value.items()}
        return [joints(each) for each in value] if isinstance(value, list) else value

    packed = msgpack.packb(joints(message))
    assert isinstance(packed, bytes)
    return packed


if __name__ == "__main__":
    for name in map(Path, sys.argv[1:]):
        save(name, asyncio.run(Player(load(name), record=True).play()))
