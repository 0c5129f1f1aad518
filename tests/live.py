"""A real service for tests: uvicorn on a free port in a thread, and a bare WebSocket client to talk to it."""

import asyncio
import json
import socket
import struct
import threading
from collections.abc import Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress

import httpx
import numpy as np
import uvicorn
import websockets

from fervor.server.run import Server, bind, configure
from fervor.server.service import Service
from fervor.settings import Settings

PROTOCOL = "fervor.v1.json"


class Live:
    """A running service."""

    def __init__(self, settings: Settings, *, port: int = 0) -> None:
        self.bound = bind("127.0.0.1", port)
        self.address = f"127.0.0.1:{self.bound.getsockname()[1]}"
        self.url = f"http://{self.address}"
        self.stream = f"ws://{self.address}/v1/stream"
        config = configure(settings)
        self.service: Service = config.app.state.service
        self._up = threading.Event()
        self._server = _Telling(config, self._up)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [self.bound]}, daemon=True)

    def start(self) -> None:
        self._thread.start()
        assert self._up.wait(30), "the service did not start"

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(30)
        assert not self._thread.is_alive(), "the service did not stop"
        self.bound.close()


class _Telling(Server):
    """Says when it is up."""

    def __init__(self, config: uvicorn.Config, up: threading.Event) -> None:
        super().__init__(config)
        self._up = up

    async def startup(self, sockets=None) -> None:
        await super().startup(sockets)
        self._up.set()


@contextmanager
def running(*, port: int = 0, **settings) -> Iterator[Live]:
    live = Live(Settings.load(**settings), port=port)
    live.start()
    try:
        yield live
    finally:
        live.stop()


class Talk:
    """One conversation, in plain messages."""

    def __init__(self, connection) -> None:
        self.socket = connection

    async def send(self, type_: str, **fields) -> None:
        await self.socket.send(json.dumps({"type": type_, **fields}))

    async def hear(self) -> dict:
        return json.loads(await self.socket.recv())

    async def start(self, **fields) -> dict:
        await self.send("session.start", **fields)
        return await self.hear()

    async def follow(self, frames: Iterable[dict], **common) -> list[dict]:
        """Send frames one by one, and return their estimates."""
        count = 0
        for frame in frames:
            await self.send("frame", **frame, **common)
            count += 1
        return [await self.hear() for _ in range(count)]

    async def closed(self) -> tuple[int, str]:
        """Read to the end; how the service closed."""
        with suppress(websockets.ConnectionClosed):
            while True:
                await self.socket.recv()
        return self.socket.close_code, self.socket.close_reason


@asynccontextmanager
async def talk(live: Live, **options):
    options.setdefault("subprotocols", [PROTOCOL])
    async with websockets.connect(live.stream, compression=None, max_size=None, **options) as connection:
        yield Talk(connection)


def frames_of(rotations: np.ndarray, *, rate_hz: float = 60.0) -> list[dict]:
    """Rotations [frame, joint, 4] as the frames of a stream."""
    return [{"seq": seq, "t": seq / rate_hz, "q": pose.tolist()} for seq, pose in enumerate(rotations)]


def score_request(frames: list[dict], **fields) -> dict:
    """The same frames as one sequence of a scoring request."""
    kept = [{key: value for key, value in frame.items() if key != "seq"} for frame in frames]
    sequence = {key: fields.pop(key) for key in ("name", "emotion") if key in fields}
    return {"detail": "frames", "sequences": [{"frames": kept, **sequence}], **fields}


async def score(live: Live, request: dict) -> list[dict]:
    """The scored sequences of a request."""
    async with httpx.AsyncClient(base_url=live.url, timeout=60) as client:
        answer = await client.post("/v1/score", json=request)
    assert answer.status_code == 200, answer.text
    return answer.json()["sequences"]


def bare(estimates: Iterable[dict]) -> list[dict]:
    """Estimates without the name of their body."""
    return [{key: value for key, value in estimate.items() if key != "body"} for estimate in estimates]


async def eventually(condition, *, seconds: float = 10.0) -> None:
    """Wait until the service, which runs beside, has come so far."""
    async with asyncio.timeout(seconds):
        while not condition():
            await asyncio.sleep(0.005)


class RawClient:
    """A WebSocket client that does just what it is told: it can fall deaf, and send what no library would."""

    UPGRADE = (
        "GET /v1/stream HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: {}\r\n\r\n"
    )

    def __init__(self, live: Live, *, subprotocol: str = PROTOCOL) -> None:
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        host, port = live.address.split(":")
        self.socket.connect((host, int(port)))
        self.socket.sendall(self.UPGRADE.format(live.address, subprotocol).encode())
        while b"\r\n\r\n" not in self.socket.recv(4096):
            pass

    def send(self, payload: bytes, *, opcode: int = 1) -> None:
        """One frame, masked with zeros."""
        self.socket.sendall(struct.pack("!BBQ", 0x80 | opcode, 0xFF, len(payload)) + b"\0\0\0\0" + payload)

    def read_until(self, last: bytes) -> bytes:
        """Everything the service sent, up to these bytes or the end."""
        received = bytearray()
        while last not in received and (chunk := self.socket.recv(1_000_000)):
            received += chunk
        return bytes(received)

    def fall_deaf(self) -> None:
        """Ask for answers and read none, until the service takes nothing more either."""
        self.socket.settimeout(0.5)
        question = json.dumps({"type": "ping", "id": "x" * 60_000}).encode()
        with suppress(TimeoutError):
            while True:
                self.send(question)
        self.socket.settimeout(30)
