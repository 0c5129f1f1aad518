"""Whole recordings over HTTP: frames a second, and what scoring does to live sessions beside it."""

import io
import json
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from http.client import HTTPConnection

import msgpack
import numpy as np

from fervor.emotions import EMOTIONS
from fervor.model import Model, default_model_path
from fervor_bench.contestant import Running
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.machine import pinned
from fervor_bench.traffic import CYCLE, Traffic
from fervor_bench.trial import Track, Trial
from fervor_bench.usage import family_cpu_seconds

SEQUENCES = 32
"""In a request."""

ALONE = (8, 300)
"""Rows and steps of a call of the model alone, one state a body."""

MOTION = Traffic()
"""Whose motions are scored: 13 joints at 30 Hz."""


@dataclass(frozen=True, slots=True)
class Rate:
    """How fast one kind of body is scored."""

    kind: str
    sequences: int
    """In a request."""
    frames: int
    """In a sequence."""
    frames_per_second: float
    """On the one processor that the service has, parsing and answer included."""
    server_us: float
    """Processor time a frame of service and scoring process, microseconds."""


@dataclass(frozen=True, slots=True)
class Rates:
    """All kinds of bodies, and what the network alone takes."""

    kinds: Sequence[Rate]
    model_us: float
    """Processor time a frame of the model alone with one state, microseconds, the least of several while they ran."""


@dataclass(frozen=True, slots=True)
class Beside:
    """Live sessions without and with a client that scores without pause."""

    alone: Trial
    beside: Trial
    requests: int
    """Scored meanwhile."""


def npz_request(sequences: int) -> tuple[str, bytes, str]:
    """Target, body and content type of a request with one NPZ file a sequence."""
    boundary = "fervor-bench"
    parts = []
    for number in range(sequences):
        packed = io.BytesIO()
        np.savez(packed, rotations=MOTION.motion(number), rate_hz=MOTION.rate_hz, skeleton="c13")
        head = f'--{boundary}\r\nContent-Disposition: form-data; name="file"; filename="{number}.npz"\r\n\r\n'
        parts.append(head.encode() + packed.getvalue() + b"\r\n")
    body = b"".join(parts) + f"--{boundary}--\r\n".encode()
    return "/v1/score/file", body, f"multipart/form-data; boundary={boundary}"


def json_request(sequences: int) -> tuple[str, bytes, str]:
    """Target, body and content type of the same as JSON."""
    taken = [
        {
            "frames": [
                {"t": frame / MOTION.rate_hz, "q": pose} for frame, pose in enumerate(MOTION.motion(number).tolist())
            ]
        }
        for number in range(sequences)
    ]
    return "/v1/score", json.dumps({"skeleton": "c13", "sequences": taken}).encode(), "application/json"


def msgpack_request(sequences: int) -> tuple[str, bytes, str]:
    """Target, body and content type of the same as MessagePack, with raw joints."""
    taken = [
        {
            "frames": [
                {"t": frame / MOTION.rate_hz, "q": pose.astype("<f4").tobytes()}
                for frame, pose in enumerate(MOTION.motion(number))
            ]
        }
        for number in range(sequences)
    ]
    return "/v1/score", msgpack.packb({"skeleton": "c13", "sequences": taken}), "application/msgpack"


REQUESTS = {"NPZ": npz_request, "MessagePack": msgpack_request, "JSON": json_request}


def measure_rates(running: Running, processor: int, seconds: float, sequences: int = SEQUENCES) -> Rates:
    """Score requests of each kind, one after the other, for so many seconds each; the model alone in between."""
    assert running.pid is not None
    model = Model.load(default_model_path())
    rates, alone = [], []
    for kind, make in REQUESTS.items():
        alone.append(_model_us(model, processor))
        request = make(sequences)
        _score(running, *request)  # the first one starts the scoring process
        begin, used, requests = time.perf_counter(), family_cpu_seconds(running.pid), 0
        while (taken := time.perf_counter() - begin) < seconds or not requests:
            _score(running, *request)
            requests += 1
        used, scored = family_cpu_seconds(running.pid) - used, requests * sequences * CYCLE
        rates.append(Rate(kind, sequences, CYCLE, scored / taken, used / scored * 1e6))
    return Rates(rates, min(alone))


def _model_us(model: Model, processor: int) -> float:
    """Processor time a frame of the model over whole sequences, microseconds."""
    rotations = np.stack([MOTION.motion(number) for number in range(ALONE[0])])[:, : ALONE[1]]
    mask = np.ones(rotations.shape[:3], np.float32)
    emotion = np.zeros((*rotations.shape[:2], len(EMOTIONS)), np.float32)
    with pinned(processor):
        begin = time.thread_time()
        model.run(rotations, mask, emotion, model.zero_states(ALONE[0]))
        return (time.thread_time() - begin) / mask[..., 0].size * 1e6


def measure_beside(running: Running, track: Track, load: Load, sequences: int = SEQUENCES) -> Beside:
    """A load alone, then beside a client that scores NPZ files without pause."""
    alone = track.run(running, load)
    stop = threading.Event()
    requests: list[int] = []
    request = npz_request(sequences)

    def score_on() -> None:
        while not stop.is_set():
            requests.append(_score(running, *request))

    scoring = threading.Thread(target=score_on)
    scoring.start()
    try:
        beside = track.run(running, load)
    finally:
        stop.set()
        scoring.join()
    return Beside(alone, beside, len(requests))


def _score(running: Running, target: str, body: bytes, content_type: str) -> int:
    connection = HTTPConnection(running.host, running.port, timeout=120.0)
    headers = {"Content-Type": content_type}
    if running.token:
        headers["Authorization"] = f"Bearer {running.token}"
    try:
        connection.request("POST", target, body, headers)
        answer = connection.getresponse()
        said = answer.read()
    finally:
        connection.close()
    if answer.status != 200:
        raise BenchError(f"POST {target} was answered with {answer.status}: {said[:200].decode(errors='replace')}")
    return len(said)
