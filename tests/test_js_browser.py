"""The JavaScript client in a real browser: a page streams, is cut, resumes, and is told the same to the bit."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

import fervor_client
from bodies import motion
from js import built, chromium, desk  # noqa: F401  # fixtures
from live import Live
from sites import browsing, site
from test_client_reconnect import network

pytestmark = pytest.mark.timeout(300)  # the first one builds, packs and installs the client

POSES = motion(120).tolist()
TOKEN = "a-long-secret"


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_a_page_streams_and_resumes(
    chromium: str,  # noqa: F811
    desk: Path,  # noqa: F811
    tmp_path: Path,
    start_service: Callable[..., Live],
    encoding: str,
) -> None:
    with site(desk) as (origin, page):
        service = start_service(tokens=TOKEN, origins=origin, max_frames_per_second=1e6)
        with fervor_client.sync.connect(service.stream, token=TOKEN, emotion="joy") as session:
            for seq, pose in enumerate(POSES):
                session.send(pose, t=seq / 30)
            session.end()
            expected = [json.loads(estimate.model_dump_json()) for estimate in session]
        with network(service) as line:
            options = {"token": TOKEN, "emotion": "joy", "encoding": encoding}
            page.line = line
            page.story = {"url": line.url, "wrong": ["another", "not a token"], "options": options, "poses": POSES}
            with browsing(chromium, tmp_path / "profile", f"{origin}/page.html"):
                result = page.results.get(timeout=90)
    assert "failed" not in result, result
    assert result["reconnects"] == 1, result["reasons"]
    assert result["totals"]["estimates"] == len(POSES)
    if encoding == "json":
        assert result["estimates"] == expected
    else:  # float32 on the way
        assert [estimate["seq"] for estimate in result["estimates"]] == list(range(len(POSES)))
        for estimate, exact in zip(result["estimates"], expected, strict=True):
            assert estimate["intensity"] == pytest.approx(exact["intensity"], abs=1e-5)
    unknown, impossible = result["refused"]
    assert unknown.startswith("AuthError: ")
    assert "wants a token" in unknown
    assert impossible.startswith("InputError: the token holds characters that a browser can't send")
