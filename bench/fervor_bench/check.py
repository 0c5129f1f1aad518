"""Whether a contestant computes what the model does; one that does not is not measured."""

import json
from typing import Any

import msgpack
import numpy as np
import numpy.typing as npt
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from fervor.emotions import EMOTIONS
from fervor.model import Model, default_model_path
from fervor.skeletons.rig import JOINTS
from fervor_bench.contestant import Running
from fervor_bench.errors import BenchError
from fervor_bench.traffic import Traffic

FRAMES = 60
"""2 s: before the service's second state is heard, which others don't have."""

TOLERANCE = 1e-4


def check_estimates(running: Running, traffic: Traffic) -> float:
    """The largest difference between a contestant's intensities and the model's.

    Args:
        running: the contestant.
        traffic: of one body of the rig's 13 joints, a divisor of `FRAMES` frames a message.

    Raises:
        BenchError: they differ by more than `TOLERANCE`, or there are none.
    """
    difference = float(np.abs(_answered(running, traffic) - _expected(traffic)).max())
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


def _expected(traffic: Traffic) -> npt.NDArray[np.float64]:
    model = Model.load(default_model_path())
    rotations = traffic.motion(0)[None, :FRAMES]  # [1, frame, joint, 4]
    emotion = np.zeros((1, FRAMES, len(EMOTIONS)), np.float32)
    if traffic.emotion in EMOTIONS:
        emotion[..., EMOTIONS.index(traffic.emotion)] = 1.0
    mask = np.ones((1, FRAMES, len(JOINTS)), np.float32)
    outputs = model.run(rotations, mask, emotion, model.zero_states(1))
    return np.asarray(outputs.intensity[0], np.float64)
