"""Whether a contestant computes what the model does; one that does not is not measured."""

import json
from typing import Any

import msgpack
import numpy as np
import numpy.typing as npt
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from fervor_bench.contestant import Running
from fervor_bench.errors import BenchError
from fervor_bench.reference import expected_intensities
from fervor_bench.traffic import Traffic

FRAMES = 300
"""10 s: two states have spoken, and one has been restarted."""

TOLERANCE = 1e-4


def check_estimates(running: Running, traffic: Traffic, *, grid: bool, states: int) -> float:
    """The largest difference between a contestant's intensities and the model's.

    Args:
        running: the contestant.
        traffic: of one body of the rig's 13 joints, a divisor of `FRAMES` frames a message.
        grid: whether it puts poses on the model's grid by their times; else it makes every frame a step.
        states: that it keeps of a body.

    Raises:
        BenchError: they differ by more than `TOLERANCE`, or there are none.
    """
    expected = expected_intensities(traffic, FRAMES, grid=grid, states=states)
    difference = float(np.abs(_answered(running, traffic) - expected).max())
    if not difference <= TOLERANCE:
        raise BenchError(
            f"estimates differ from the model's by {difference:.2g}; expected at most {TOLERANCE:g}, so times mean "
            "nothing"
        )
    return difference


def _answered(running: Running, traffic: Traffic) -> npt.NDArray[np.float64]:
    headers = {"Authorization": f"Bearer {running.token}"} if running.token else {}
    intensities: list[float] = []
    with connect(
        running.url, subprotocols=[Subprotocol(traffic.subprotocol)], additional_headers=headers, compression=None
    ) as socket:
        for payload in (traffic.encode(traffic.start()), *traffic.payloads(0, FRAMES // traffic.frames_per_message)):
            socket.send(payload.decode() if traffic.encoding == "json" else payload)
        while len(intensities) < FRAMES:
            message = _decoded(socket.recv(timeout=10.0))
            if message["type"] in ("estimate", "estimates"):
                intensities += [estimate["intensity"] for estimate in message.get("estimates", [message])]
            elif message["type"] == "error":
                raise BenchError(f"a frame was refused: {message['message']}")
    return np.array(intensities)


def _decoded(message: str | bytes) -> dict[str, Any]:
    decoded: dict[str, Any] = json.loads(message) if isinstance(message, str) else msgpack.unpackb(message)
    return decoded
