"""A web site for tests that are pages in a real browser: it serves a folder, and takes what a page posts."""

import functools
import http.server
import json
import queue
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from test_client_reconnect import Network

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

    def log_message(self, *_: Any) -> None:
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
