"""The JavaScript client in a real browser: a page streams, is cut, resumes, and is told the same to the bit."""

import functools
import http.server
import json
import os
import queue
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import fervor_client
from bodies import motion
from js import built, desk  # noqa: F401  # fixtures
from live import Live
from test_client_reconnect import Network, network

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
POSES = motion(120).tolist()
TOKEN = "a-long-secret"


@pytest.fixture(scope="module")
def chromium() -> str:
    """The browser; skips where there is none, except in CI."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        if os.environ.get("CI"):
            pytest.fail("no Chromium is here")
        pytest.skip("no Chromium is here")
    return found


class Site(http.server.SimpleHTTPRequestHandler):
    """The page's own site: its files, and where it posts to."""

    story: dict[str, Any]
    results: "queue.Queue[Any]"
    line: Network

    def do_GET(self) -> None:
        if self.path != "/story.json":
            super().do_GET()
            return
        self.answer(json.dumps(type(self).story).encode())

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if self.path == "/cut":
            type(self).line.cut()
        else:
            type(self).results.put(json.loads(body))
        self.answer(b"{}")

    def answer(self, body: bytes) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        pass


@contextmanager
def site(folder: Path) -> Iterator[tuple[str, type[Site]]]:
    class Own(Site):
        results: "queue.Queue[Any]" = queue.Queue()

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Own, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", Own
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@contextmanager
def browsing(chromium: str, profile: Path, url: str) -> Iterator[None]:
    process = subprocess.Popen(
        [chromium, *FLAGS, f"--user-data-dir={profile}", url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait(20)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_a_page_streams_and_resumes(
    chromium: str,
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
