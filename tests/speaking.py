"""A service that only pretends, for tests of the load generator: it answers, or not, as it is told."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgpack
from websockets.sync.server import ServerConnection, serve

from fervor_bench.contestant import Running

Answer = Callable[[dict[str, Any]], list[dict[str, Any]]]
"""From a message to the messages it is answered with; raising ConnectionError closes the session."""

STARTED = {"type": "session.started", "session_id": "0"}


def estimate(frame: dict[str, Any]) -> dict[str, Any]:
    return {"type": "estimate", "body": frame["body"], "seq": frame["seq"], "t": frame["t"], "intensity": 0.5}


def answer(message: dict[str, Any]) -> list[dict[str, Any]]:
    """As a service would."""
    if message["type"] == "session.start":
        return [STARTED]
    if message["type"] == "frames":
        return [{"type": "estimates", "estimates": [estimate(frame) for frame in message["frames"]]}]
    return [estimate(message)]


@contextmanager
def speaking(said: Answer = answer) -> Iterator[Running]:
    """Run it on a free port; all sessions are answered by the same function."""
    with speaking_to_each(lambda: said) as running:
        yield running


@contextmanager
def speaking_to_each(conversation: Callable[[], Answer]) -> Iterator[Running]:
    """Run it on a free port; every session is answered by a function made for it."""

    def converse(connection: ServerConnection) -> None:
        said = conversation()
        for data in connection:
            text = isinstance(data, str)
            try:
                answers = said(json.loads(data) if text else msgpack.unpackb(data))
            except ConnectionError:
                return
            for message in answers:
                connection.send(json.dumps(message) if text else msgpack.packb(message))

    with serve(
        converse, "127.0.0.1", 0, compression=None, subprotocols=["fervor.v1.json", "fervor.v1.msgpack"]
    ) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield Running("127.0.0.1", server.socket.getsockname()[1])
        finally:
            server.shutdown()
            thread.join(10)
