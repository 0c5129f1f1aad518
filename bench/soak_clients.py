"""The clients of a soak: each talks to the service in one way after the other, good ones and bad ones."""

import asyncio
import json
import random
from collections import Counter
from collections.abc import Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any

import httpx
import numpy as np
import websockets

PROTOCOL = "fervor.v1.json"
POSES = np.round(np.random.default_rng(0).normal([0, 0, 0, 2], 0.1, (64, 13, 4)), 3)
POSES = np.round(POSES / np.linalg.norm(POSES, axis=-1, keepdims=True), 4).tolist()
GARBAGE = (
    "",
    "{",
    "null",
    "[]",
    '{"type": "frame"}',
    '{"type": "frame", "seq": 0, "t": 0, "q": [[9, 9, 9, 9]]}',
    "\0" * 99,
)


def frame(seq: int, body: str = "0") -> dict[str, Any]:
    return {"type": "frame", "body": body, "seq": seq, "t": seq / 30.0, "q": POSES[seq % len(POSES)]}


class Churn:
    """One client after the other, until cancelled."""

    def __init__(self, address: str, *, seed: int, done: Counter[str]) -> None:
        self._address = address
        self._dice = random.Random(seed)
        self._done = done

    async def run(self) -> None:
        """At random, for ever."""
        while True:
            await self._once(self._dice.choice(KINDS))

    async def each(self) -> None:
        """Every kind once."""
        for kind in KINDS:
            await self._once(kind)

    async def _once(self, kind: str) -> None:
        async with asyncio.timeout(120):
            await getattr(self, f"_{kind}")()
        self._done[kind] += 1

    @asynccontextmanager
    async def _talk(self, **options: Any):
        options = {
            "subprotocols": [PROTOCOL],
            "compression": None,
            "max_size": None,
            "close_timeout": 5.0,
            "open_timeout": 60.0,
            **options,
        }
        async with websockets.connect(f"ws://{self._address}/v1/stream", **options) as socket:
            yield socket

    async def _start(self, socket: Any, **fields: Any) -> dict[str, Any]:
        await socket.send(json.dumps({"type": "session.start", "emotion": "joy", **fields}))
        return json.loads(await socket.recv())

    async def _follow(self, socket: Any, frames: Sequence[dict[str, Any]]) -> dict[str, str]:
        """Send frames and read until all are answered; the newest checkpoint of each body."""
        for each in frames:
            await socket.send(json.dumps(each))
        answered, tokens = 0, {}
        while answered < len(frames):
            message = json.loads(await socket.recv())
            if message["type"] == "checkpoint":
                tokens[message["body"]] = message["token"]
            answered += message["type"] in ("estimate", "error")
        return tokens

    async def _polite(self) -> None:
        async with self._talk() as socket:
            await self._start(socket, memory=self._dice.choice(["staggered", "stateful", "window"]))
            await self._follow(socket, [frame(seq) for seq in range(self._dice.randint(1, 60))])
            await socket.send('{"type": "session.end"}')
            await socket.wait_closed()

    async def _crowd(self) -> None:
        async with self._talk() as socket:
            await self._start(socket)
            for person in range(30):  # more than a session may have at once
                await self._follow(socket, [frame(seq, f"p{person}") for seq in range(3)])
                await socket.send(json.dumps({"type": "body.end", "body": f"p{person}"}))

    async def _torn(self) -> None:
        async with self._talk() as socket:
            await self._start(socket, checkpoint_s=0.5)
            for seq in range(self._dice.randint(0, 40)):
                await socket.send(json.dumps(frame(seq)))
            socket.transport.abort()

    async def _resume(self) -> None:
        tokens: dict[str, str] = {}
        for _ in range(3):
            async with self._talk() as socket:
                started = await self._start(socket, checkpoint_s=0.5, resume=list(tokens.values()))
                first = max((each["seq"] + 1 for each in started.get("resumed", ())), default=0)
                tokens = await self._follow(socket, [frame(seq) for seq in range(first, first + 30)]) or tokens
                socket.transport.abort()

    async def _garbage(self) -> None:
        with suppress(websockets.ConnectionClosed):
            async with self._talk() as socket:
                if self._dice.random() < 0.7:
                    await self._start(socket)
                for _ in range(20):
                    await socket.send(self._dice.choice(GARBAGE))
                    await socket.recv()

    async def _refused(self) -> None:
        with suppress(websockets.InvalidStatus):
            async with self._talk(subprotocols=["chat"]):
                raise AssertionError("a client of another protocol was let in")

    async def _deaf(self) -> None:
        """Asks for megabytes and reads none of them."""
        question = json.dumps({"type": "ping", "id": "x" * 50_000})
        with suppress(websockets.ConnectionClosed, TimeoutError):
            async with self._talk(max_queue=1) as socket:
                await self._start(socket)
                async with asyncio.timeout(1.0):
                    for _ in range(400):
                        await socket.send(question)
                socket.transport.abort()

    async def _score(self) -> None:
        frames = [{key: value for key, value in frame(seq).items() if key in ("t", "q")} for seq in range(60)]
        async with httpx.AsyncClient(timeout=60.0) as http:
            answer = await http.post(f"http://{self._address}/v1/score", json={"sequences": [{"frames": frames}]})
            assert answer.status_code in (200, 503), answer.text


KINDS = ("polite", "crowd", "torn", "resume", "garbage", "refused", "deaf", "score")
"""The ways to talk to a service."""
