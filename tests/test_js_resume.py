"""A Node script streams on through a kill -9, a restart and a drain of the service: every estimate, to the bit."""

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fervor_client
from bodies import motion
from js import Script, built, desk, script  # noqa: F401  # fixtures
from live import Live, running
from test_client_reconnect import network
from test_proof_resume import served

pytestmark = pytest.mark.timeout(300)  # the first one builds, packs and installs the client

KEY = "a key for all the replicas"
BODIES, FRAMES = "abc", 240
POSES = {
    # float32 can hold them, so that both encodings send the same numbers
    body: motion(FRAMES, seed=number).astype(np.float32).astype(np.float64)
    for number, body in enumerate(BODIES)
}
Told = dict[tuple[str, int], dict[str, Any]]

OPTIONS = {"emotion": "joy", "checkpoint_s": 0.5, "by_emotion": True}


@pytest.fixture(scope="module")
def poses(desk: Path) -> Path:  # noqa: F811
    path = desk / "poses.json"
    path.write_text(json.dumps({body: each.tolist() for body, each in POSES.items()}))
    return path


@pytest.fixture(scope="module")
def expected() -> Told:
    """What the Python client is told by a service that nothing happens to."""
    with running(max_frames_per_second=1e6) as live, fervor_client.sync.connect(live.stream, **OPTIONS) as session:  # type: ignore[arg-type]
        for seq in range(FRAMES):
            for body in BODIES:
                session.send(POSES[body][seq], body=body, seq=seq, t=seq / 40)
        session.end()
        return by_frame(json.loads(estimate.model_dump_json()) for estimate in session)


def by_frame(estimates: Any) -> Told:
    told: Told = {}
    for estimate in estimates:
        key = (estimate["body"], estimate["seq"])
        assert key not in told, "each frame is answered once"
        told[key] = estimate
    return told


def asked(poses: Path, encoding: str, *waits: int, **options: int) -> str:
    return json.dumps({"poses": str(poses), "waits": waits, "options": {**OPTIONS, **options, "encoding": encoding}})


def finish(running: Script) -> tuple[dict[str, Any], Told]:
    last = running.hear(has="totals")
    return last, by_frame(last["estimates"])


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_every_estimate_of_a_stream_whose_service_was_killed_twice(
    desk: Path,  # noqa: F811
    poses: Path,
    expected: Told,
    encoding: str,
) -> None:
    waits = (100, 170)
    with ExitStack() as services:
        process, port = services.enter_context(served("0"))
        with script(desk, "stream.js", f"ws://127.0.0.1:{port}", asked(poses, encoding, *waits)) as running:
            for wait in waits:
                assert running.hear(has="waits")["waits"] == wait
                process.kill()
                process.wait()
                process, _ = services.enter_context(served(port))
                running.tell()
            last, got = finish(running)
    assert got == expected
    assert len(got) == last["totals"]["estimates"] == FRAMES * len(BODIES)
    assert last["reconnects"] >= 2
    resumed = [news for news in running.said if news.get("reconnect")]
    assert all(news["exact"] and not news["anew"] for news in resumed)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_a_service_that_is_stopped_hands_over_to_the_next(
    desk: Path,  # noqa: F811
    poses: Path,
    expected: Told,
    encoding: str,
) -> None:
    with ExitStack() as services:
        process, port = services.enter_context(served("0"))
        with script(desk, "stream.js", f"ws://127.0.0.1:{port}", asked(poses, encoding, 120)) as running:
            running.hear(has="waits")
            process.terminate()
            stopped = running.hear(has="reconnect")
            assert stopped["closeCode"] == 1012
            process.wait()
            services.enter_context(served(port))
            running.tell()
            _, got = finish(running)
    assert got == expected
    assert not any(news.get("anew") for news in running.said)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_a_line_that_is_cut_in_mid_message_over_and_over_changes_nothing(
    desk: Path,  # noqa: F811
    poses: Path,
    start_service: Callable[..., Live],
    expected: Told,
    encoding: str,
) -> None:
    with network(start_service(max_frames_per_second=1e6)) as line:
        line.most_bytes = (60_000, 120_000)
        with script(desk, "stream.js", line.url, asked(poses, encoding, window=16)) as running:
            last, got = finish(running)
    assert got == expected
    assert last["reconnects"] >= 2


def test_a_wrong_token_is_refused_and_the_right_one_is_not(
    desk: Path,  # noqa: F811
    poses: Path,
    start_service: Callable[..., Live],
) -> None:
    guarded = start_service(tokens="a-long-secret", max_frames_per_second=1e6)
    ask = {"poses": str(poses), "options": {"token": "a-long-secret"}}
    with script(desk, "stream.js", guarded.stream, json.dumps(ask)) as running:
        assert finish(running)[0]["totals"]["estimates"] == FRAMES * len(BODIES)
    with script(desk, "refused.js", guarded.stream, '{"token": "another"}') as running:
        refused = running.hear(has="name")
    assert (refused["name"], refused["code"], refused["closeCode"]) == ("AuthError", "unauthorized", 4401)
    assert "wants a token" in refused["message"]


def test_a_full_service_says_when_to_come_again(desk: Path, start_service: Callable[..., Live]) -> None:  # noqa: F811
    full = start_service(max_sessions=1)
    with fervor_client.sync.connect(full.stream) as session, script(desk, "refused.js", full.stream, "{}") as running:
        refused = running.hear(has="name")
        assert session.in_flight == 0
    assert (refused["name"], refused["code"], refused["retryAfter"]) == ("Overloaded", "overloaded", 1)


def test_nobody_there(desk: Path) -> None:  # noqa: F811
    with script(desk, "refused.js", "ws://127.0.0.1:9", "{}") as running:
        refused = running.hear(has="name")
    assert refused["name"] == "Unreachable"
    assert "is `fervor serve` running there?" in refused["message"]
