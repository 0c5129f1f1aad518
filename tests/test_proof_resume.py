"""A robot's stream survives a kill -9 of the service: the client goes on by itself, to the bit."""

import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest

import fervor_client
from bodies import motion
from live import Live
from program import start_fervor

KEY = "a key for tests that is long enough"
BODIES, FRAMES = "abc", 240


@contextmanager
def served(port: str) -> Iterator["tuple[subprocess.Popen[str], str]"]:
    process = start_fervor("serve", "--port", port, FERVOR_CHECKPOINT_KEYS=KEY)
    for line in process.stderr or ():
        if "listening on http://" in line:
            break
    drained = threading.Thread(target=process.communicate, daemon=True)
    drained.start()
    try:
        yield process, line.rstrip().rpartition(":")[2]
    finally:
        process.kill()
        drained.join()


def stream(url: str, at: dict[int, Callable[[], None]]) -> dict[tuple[str, int], fervor_client.Estimate]:
    """Send everything; at some frames something happens first."""
    got: dict[tuple[str, int], fervor_client.Estimate] = {}
    poses = {body: motion(FRAMES, seed=number) for number, body in enumerate(BODIES)}
    with fervor_client.sync.connect(url, emotion="joy", checkpoint_s=0.5, by_emotion=True) as session:
        for seq in range(FRAMES):
            if seq in at:
                at[seq]()
            for body in BODIES:
                session.send(poses[body][seq], body=body, seq=seq, t=seq / 40)
        session.end()
        for estimate in session:
            assert got.setdefault((estimate.body, estimate.seq), estimate) is estimate, "each frame is answered once"
    return got


@pytest.mark.timeout(180)
def test_every_estimate_of_a_stream_that_was_killed_twice(live: Live) -> None:
    expected = stream(live.stream, {})
    with ExitStack() as services:
        process, port = services.enter_context(served("0"))

        def kill_and_restart() -> None:
            nonlocal process
            process.kill()
            process.wait()
            process, _ = services.enter_context(served(port))

        got = stream(f"ws://127.0.0.1:{port}", {100: kill_and_restart, 170: kill_and_restart})
    assert got == expected
    assert len(got) == FRAMES * len(BODIES)
