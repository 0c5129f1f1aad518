"""The log: one form for all, with sessions in it, and never a secret."""

import base64
import json
import logging
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
import websockets

from bodies import motion
from fervor.server.logs import JsonFormatter, TextFormatter, leave_out_query
from live import PROTOCOL, RawClient, frames_of
from program import start_fervor


def record(message: str, *arguments: object, **extra: object) -> logging.LogRecord:
    made = logging.makeLogRecord({"name": "a.b", "levelname": "INFO", "msg": message, "args": arguments, **extra})
    made.created = 0.25
    return made


def test_json_is_one_object_a_line() -> None:
    line = JsonFormatter().format(record("two\nlines of %s", "text", session="5e55", client="pepper"))
    assert "\n" not in line
    assert json.loads(line) == {
        "time": "1970-01-01T00:00:00.250+00:00",
        "level": "info",
        "logger": "a.b",
        "message": "two\nlines of text",
        "session": "5e55",
        "client": "pepper",
    }


def test_json_holds_a_trace() -> None:
    try:
        _ = 1 / 0
    except ZeroDivisionError:
        line = JsonFormatter().format(record("failed", exc_info=sys.exc_info()))
    assert "ZeroDivisionError" in json.loads(line)["exception"]
    assert "\n" not in line


def test_text_names_the_session_and_forges_no_line() -> None:
    line = TextFormatter().format(record("a\n2020-01-01 INFO forged", session="5e55", client=None))
    assert line.endswith("INFO a.b: a\\n2020-01-01 INFO forged session=5e55")


def test_queries_are_left_out() -> None:
    made = record('%s - "%s %s HTTP/%s" %d', "1.2.3.4:5", "GET", "/v1/model?token=s3cret", "1.1", 401)
    assert leave_out_query(made)
    assert made.getMessage() == '1.2.3.4:5 - "GET /v1/model HTTP/1.1" 401'


@contextmanager
def logging_service(tmp_path: Path, *options: str, **environment: str):
    """The program; its address, and what it logged once it has ended."""
    process = start_fervor("serve", "--port", "0", *options, **environment)
    heard: list[str] = []
    try:
        for line in process.stderr:
            heard.append(line)
            if "listening on http://" in line:
                break
        address = heard[-1].rpartition("http://")[2].partition('"')[0].strip()
        yield address, heard
    finally:
        process.terminate()
        out, err = process.communicate(timeout=30)
        heard += [*out.splitlines(), *err.splitlines()]


async def converse(address: str, *, token: str, by_header: bool = True) -> None:
    options = {"subprotocols": [PROTOCOL]}
    if by_header:
        options["additional_headers"] = {"Authorization": f"Bearer {token}"}
    else:
        options["subprotocols"].append(f"fervor.token.{token}")
    async with websockets.connect(f"ws://{address}/v1/stream?token={token}", **options) as stream:
        await stream.send(json.dumps({"type": "session.start", "checkpoint_s": 0.1}))
        await stream.recv()
        for frame in frames_of(motion(3)):
            await stream.send(json.dumps({"type": "frame", **frame}))
        await stream.send('{"type": "session.end"}')
        with suppress(websockets.ConnectionClosed):
            while True:
                await stream.recv()


@pytest.mark.parametrize("log_format", ["json", "text"])
async def test_no_secret_is_ever_logged(log_format: str, tmp_path: Path) -> None:
    right, env, wrong, key = "right-s3cret-token", "env-s3cret-token", "wrong-s3cret-token", "checkpoint-s3cret-key"
    (tmp_path / "tokens").write_text(f"pepper {right}", encoding="utf-8")
    options = ("--log-format", log_format, "--log-level", "debug", "--tokens-file", str(tmp_path / "tokens"))
    with logging_service(tmp_path, *options, FERVOR_TOKENS=env, FERVOR_CHECKPOINT_KEYS=key) as (address, heard):
        await converse(address, token=right)
        await converse(address, token=env, by_header=False)
        for by_header in (True, False):
            with pytest.raises(websockets.InvalidStatus):
                await converse(address, token=wrong, by_header=by_header)
        basic = base64.b64encode(f"pepper:{right}".encode()).decode()
        async with httpx.AsyncClient(base_url=f"http://{address}") as client:
            for how in (f"Bearer {right}", f"Bearer {wrong}", f"Basic {basic}", right):
                for method, path in (("GET", "/v1/model"), ("POST", "/v1/score"), ("GET", f"/{right}x/?a={right}")):
                    url = f"{path}?token={wrong}&access_token={right}" if "?" not in path else path.replace(right, "x")
                    await client.request(method, url, headers={"Authorization": how}, content=b"{}")
    said = "\n".join(heard)
    assert "s3cret" not in said
    assert basic not in said
    assert said.count("session ended: ended") == 2
    assert "/v1/model" in said  # the access log was there


async def test_sessions_leave_lines_that_programs_can_read(tmp_path: Path) -> None:
    (tmp_path / "tokens").write_text("pepper a-token", encoding="utf-8")
    options = ("--log-format", "json", "--tokens-file", str(tmp_path / "tokens"))
    with logging_service(tmp_path, *options) as (address, heard):
        await converse(address, token="a-token")
    lines = [json.loads(line) for line in heard if line.strip()]  # all of them are JSON, uvicorn's too
    begun, ended = (line for line in lines if "session" in line)
    assert (begun["client"], begun["message"]) == ("pepper", f"session begun ({PROTOCOL})")
    assert (ended["session"], ended["client"], ended["reason"]) == (begun["session"], "pepper", "ended")
    assert ended["totals"]["estimates"] == 3
    assert any(line["logger"] == "uvicorn.error" for line in lines)


@pytest.mark.parametrize("log_format", ["json", "text"])
def test_text_that_is_no_utf8_leaves_one_line(log_format: str, tmp_path: Path) -> None:
    with logging_service(tmp_path, "--log-format", log_format) as (address, heard):
        client = RawClient(SimpleNamespace(address=address))
        with client.socket:
            client.send(b"\xff\xfe")
            assert client.read_until(b"\x03\xef").endswith(b"\x88\x02\x03\xef")  # closed with 1007
    assert sum("UTF-8" in line for line in heard) == 1
    assert not any("Traceback" in line or "UnicodeDecodeError" in line for line in heard)
