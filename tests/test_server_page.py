"""The page's files: served with headers that hold it to its own origin, and a word where there are none."""

import asyncio
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from fervor.server.page import DETECTOR, serve_page


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "index.html").write_text("the page")
    (tmp_path / DETECTOR).write_text("the detector")
    (tmp_path / "page.js").write_text("export {}")
    return tmp_path


def ask(folder: Path, path: str, method: str = "GET") -> httpx.Response:
    app = FastAPI()
    serve_page(app, folder)

    async def answer() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://fervor") as client:
            return await client.request(method, path)

    return asyncio.run(answer())


def test_the_page_is_at_the_root(folder: Path) -> None:
    answer = ask(folder, "/")
    assert (answer.status_code, answer.text) == (200, "the page")
    assert answer.headers["content-type"].startswith("text/html")
    assert ask(folder, "/", "HEAD").status_code == 200


def test_its_files_are_beside_it(folder: Path) -> None:
    answer = ask(folder, "/page/page.js")
    assert answer.status_code == 200
    assert "javascript" in answer.headers["content-type"]
    assert ask(folder, "/page/nothing.js").status_code == 404
    assert ask(folder, "/page/../page.py").status_code == 404


@pytest.mark.parametrize("path", ["/", "/page/page.js", f"/page/{DETECTOR}"])
def test_headers_let_nothing_in_from_elsewhere(path: str, folder: Path) -> None:
    headers = ask(folder, path).headers
    rules = dict(rule.strip().split(" ", 1) for rule in headers["content-security-policy"].split(";"))
    assert rules["default-src"] == "'none'"
    assert "unsafe-inline" not in headers["content-security-policy"]
    assert "'unsafe-eval'" not in headers["content-security-policy"]
    assert "http" not in headers["content-security-policy"]
    assert rules["frame-ancestors"] == ("'self'" if path.endswith(DETECTOR) else "'none'")
    assert headers["x-content-type-options"] == "nosniff"


def test_only_the_detector_may_run_webassembly(folder: Path) -> None:
    assert "wasm-unsafe-eval" not in ask(folder, "/").headers["content-security-policy"]
    assert "wasm-unsafe-eval" in ask(folder, f"/page/{DETECTOR}").headers["content-security-policy"]


def test_a_page_that_was_not_built_says_how(tmp_path: Path) -> None:
    answer = ask(tmp_path / "nowhere", "/")
    assert answer.status_code == 200
    assert "<code>make page</code>" in answer.text
    assert answer.headers["content-security-policy"]
