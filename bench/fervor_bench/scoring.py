"""Whole recordings over HTTP: frames a second, and what scoring does to live sessions beside it."""

import io
import json
import threading
import time
from dataclasses import dataclass
from http.client import HTTPConnection

import numpy as np

from fervor_bench.contestant import Running
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.traffic import CYCLE, Traffic
from fervor_bench.trial import Track, Trial
from fervor_bench.usage import family_cpu_seconds

SEQUENCES = 8
"""In a request."""

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


REQUESTS = {"NPZ": npz_request, "JSON": json_request}


def measure_rates(running: Running, seconds: float, sequences: int = SEQUENCES) -> list[Rate]:
    """Score requests of each kind, one after the other, for so many seconds each."""
    assert running.pid is not None
    rates = []
    for kind, make in REQUESTS.items():
        request = make(sequences)
        _score(running, *request)  # the first one starts the scoring process
        begin, used, requests = time.perf_counter(), family_cpu_seconds(running.pid), 0
        while (taken := time.perf_counter() - begin) < seconds or not requests:
            _score(running, *request)
            requests += 1
        used, scored = family_cpu_seconds(running.pid) - used, requests * sequences * CYCLE
        rates.append(Rate(kind, sequences, CYCLE, scored / taken, used / scored * 1e6))
    return rates


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
