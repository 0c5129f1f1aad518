"""The service as a competent developer would write it in a day: FastAPI, pydantic, one call of onnxruntime a frame.

One state a body, no batching, no gaps, no checkpoints. It answers the same first messages as the service, so that one
load generator does for both. `--tuned` adds what is a matter of options: uvloop, httptools, the sans-I/O WebSocket
protocol, no compression, and one thread for onnxruntime.

    python -m fervor_bench.naive PORT MODEL PAUSES [--tuned]
"""

import argparse
from pathlib import Path
from typing import Annotated, Any, Literal
from uuid import uuid4

import numpy as np
import numpy.typing as npt
import onnxruntime
import uvicorn
from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, Field, TypeAdapter

from fervor.emotions import EMOTIONS
from fervor.metadata import INTENSITY, NEXT
from fervor_bench.pauses import note_pauses

Floats = npt.NDArray[np.float32]

JOINTS = 13


class Start(BaseModel):
    type: Literal["session.start"]
    emotion: str = "unknown"


class Frame(BaseModel):
    type: Literal["frame"]
    body: str
    seq: int
    t: float
    q: list[Annotated[list[float], Field(min_length=4, max_length=4)]] = Field(min_length=JOINTS, max_length=JOINTS)


class Started(BaseModel):
    type: Literal["session.started"] = "session.started"
    session_id: str


class Estimate(BaseModel):
    type: Literal["estimate"] = "estimate"
    body: str
    seq: int
    t: float
    intensity: float
    level: Literal["weak", "strong"]
    emotion: str
    status: Literal["ok"] = "ok"


MESSAGE: TypeAdapter[Start | Frame] = TypeAdapter(Annotated[Start | Frame, Field(discriminator="type")])


class Network:
    """The model file."""

    def __init__(self, path: Path, *, tuned: bool) -> None:
        options = onnxruntime.SessionOptions()
        if tuned:
            options.intra_op_num_threads = 1
            options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        self._session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        known = {"rotations", "mask", "emotion"}
        self.states = {
            tensor.name: tensor.shape[1:] for tensor in self._session.get_inputs() if tensor.name not in known
        }

    def zero_states(self) -> dict[str, Floats]:
        return {name: np.zeros((1, *shape), np.float32) for name, shape in self.states.items()}

    def step(self, rotations: Floats, emotion: Floats, states: dict[str, Floats]) -> tuple[float, dict[str, Floats]]:
        feed = {"rotations": rotations, "mask": np.ones((1, 1, JOINTS), np.float32), "emotion": emotion, **states}
        names = [INTENSITY, *(NEXT + name for name in states)]
        intensity, *after = self._session.run(names, feed)
        return float(intensity[0, 0]), dict(zip(states, after, strict=True))


def create_app(network: Network) -> FastAPI:
    app = FastAPI()

    @app.get("/readyz")
    async def ready() -> dict[str, str]:
        return {"status": "ready"}

    @app.websocket("/v1/stream")
    async def stream(websocket: WebSocket) -> None:
        offered = websocket.scope["subprotocols"]
        await websocket.accept(subprotocol=offered[0] if offered else None)
        bodies: dict[str, dict[str, Floats]] = {}
        label = "unknown"
        try:
            while True:
                message = MESSAGE.validate_json(await websocket.receive_text())
                if isinstance(message, Start):
                    label = message.emotion
                    answer: BaseModel = Started(session_id=uuid4().hex)
                else:
                    states = bodies.get(message.body) or network.zero_states()
                    intensity, bodies[message.body] = network.step(*_arrays(message, label), states)
                    answer = _estimate(message, label, intensity)
                await websocket.send_text(answer.model_dump_json())
        except WebSocketDisconnect:
            pass

    return app


def _arrays(frame: Frame, label: str) -> tuple[Floats, Floats]:
    rotations = np.array(frame.q, np.float32)[None, None]  # [1, 1, joint, 4]
    emotion = np.zeros((1, 1, len(EMOTIONS)), np.float32)
    if label in EMOTIONS:
        emotion[0, 0, EMOTIONS.index(label)] = 1.0
    return rotations, emotion


def _estimate(frame: Frame, label: str, intensity: float) -> Estimate:
    level: Literal["weak", "strong"] = "strong" if intensity >= 0.5 else "weak"
    return Estimate(body=frame.body, seq=frame.seq, t=frame.t, intensity=intensity, level=level, emotion=label)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m fervor_bench.naive")
    parser.add_argument("port", type=int)
    parser.add_argument("model", type=Path)
    parser.add_argument("pauses", type=Path)
    parser.add_argument("--tuned", action="store_true")
    options = parser.parse_args()
    note_pauses(options.pauses)
    app = create_app(Network(options.model, tuned=options.tuned))
    how: dict[str, Any] = {"loop": "asyncio", "http": "h11", "ws": "websockets"}  # a bare `pip install uvicorn`
    if options.tuned:
        how = {"loop": "uvloop", "http": "httptools", "ws": "websockets-sansio", "ws_per_message_deflate": False}
    uvicorn.run(app, host="127.0.0.1", port=options.port, log_level="warning", **how)


if __name__ == "__main__":
    main()
