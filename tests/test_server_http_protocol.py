"""Clients that take their time, have no end, or are too many: told over HTTP, and shown the door."""

import asyncio
import json
import socket
from collections.abc import Callable

import httpx
import pytest

from bodies import motion
from live import Live, eventually, frames_of, talk

FRAMES = frames_of(motion(40, seed=3))

START = "GET /healthz HTTP/1.1\r\nHost: a\r\n"


def dial(service: Live) -> socket.socket:
    host, port = service.address.split(":")
    return socket.create_connection((host, int(port)), timeout=30)


def answer_of(connection: socket.socket) -> tuple[int, dict]:
    """The status and the problem of the last response before the service closes."""
    received = b""
    while chunk := connection.recv(65536):
        received += chunk
    head, _, body = received.partition(b"\r\n\r\n")
    assert b"content-type: application/problem+json" in head.lower()
    assert b"connection: close" in head.lower()
    return int(head.split()[1]), json.loads(body)


async def undisturbed(service: Live, disturb: Callable[[], object]) -> object:
    """What `disturb` returns; a session beside it gets all its estimates, to the bit."""
    async with talk(service) as alone:
        await alone.start(emotion="joy")
        expected = await alone.follow(FRAMES)
    async with talk(service) as healthy:
        await healthy.start(emotion="joy")
        doing = asyncio.create_task(asyncio.to_thread(disturb))
        before = await healthy.follow(FRAMES[:20])
        done = await doing
        assert before + await healthy.follow(FRAMES[20:]) == expected
    return done


@pytest.mark.parametrize("said", ["", "GE", START, START + "X-Slow: a"], ids=["nothing", "method", "line", "header"])
async def test_headers_that_do_not_end_in_time_are_told_408(said: str, start_service) -> None:
    service = start_service(header_timeout_s=0.3)

    def wait() -> tuple[int, dict]:
        with dial(service) as connection:
            connection.sendall(said.encode())
            return answer_of(connection)

    status, problem = await undisturbed(service, wait)
    assert (status, problem["code"]) == (408, "request_timeout")
    assert problem["detail"] == "no request came to the end of its headers within 0.3 s"
    await eventually(lambda: service.service.connections.open == 0)


async def test_a_slow_loris_wins_no_time_by_trickling(start_service) -> None:
    service = start_service(header_timeout_s=0.5)

    def trickle() -> tuple[int, dict]:
        with dial(service) as connection:
            connection.sendall(START.encode())
            connection.settimeout(0.02)
            while True:
                connection.sendall(b"X-A: b\r\n")
                try:
                    connection.recv(1, socket.MSG_PEEK)
                except TimeoutError:
                    continue
                connection.settimeout(30)
                return answer_of(connection)

    status, _ = await undisturbed(service, trickle)
    assert status == 408


async def test_a_body_that_does_not_come_in_time_is_told_408(start_service) -> None:
    service = start_service(body_timeout_s=0.3)

    def wait() -> tuple[int, dict]:
        with dial(service) as connection:
            connection.sendall(b"POST /v1/score HTTP/1.1\r\nHost: a\r\nContent-Length: 1000\r\n\r\n{")
            return answer_of(connection)

    status, problem = await undisturbed(service, wait)
    assert (status, problem["detail"]) == (408, "the body did not come within 0.3 s")
    await eventually(lambda: service.service.connections.open == 0)


def test_an_answer_is_no_reason_to_go_on_for_ever(start_service) -> None:
    service = start_service(body_timeout_s=0.3, score_max_bytes=2000)
    with dial(service) as connection:
        connection.sendall(b"POST /v1/score HTTP/1.1\r\nHost: a\r\nContent-Length: 100000\r\n\r\n")
        received = b""
        while chunk := connection.recv(65536):
            received += chunk
    assert received.startswith(b"HTTP/1.1 413 ")
    assert received.count(b"HTTP/1.1 ") == 1


@pytest.mark.parametrize("endless", ["GET /" + "a" * 5000, START + "X: " + "b" * 5000, START + "X: b\r\n" * 1000])
async def test_headers_without_end_are_told_431(endless: str, start_service) -> None:
    service = start_service(max_header_bytes=4096)

    def send() -> tuple[int, dict]:
        with dial(service) as connection:
            connection.sendall(endless.encode())
            return answer_of(connection)

    status, problem = await undisturbed(service, send)
    assert (status, problem["code"]) == (431, "headers_too_large")
    assert problem["detail"] == "the headers are larger than 4096 bytes, the most that this service takes"


def test_headers_that_just_fit_are_taken_and_bodies_are_no_headers(start_service) -> None:
    service = start_service(max_header_bytes=4096)
    with httpx.Client(base_url=service.url) as client:
        assert client.get("/healthz", headers={"X": "b" * 3500}).status_code == 200
        assert client.post("/v1/score", content=b"x" * 100_000).status_code == 422
        assert client.get("/healthz", headers={"X": "b" * 3500}).status_code == 200


@pytest.mark.parametrize("garbage", [b"\x16\x03\x01\x02\x00\x01\x00", b"hello\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n"])
def test_what_is_no_http_is_told_400(garbage: bytes, live: Live) -> None:
    with dial(live) as connection:
        connection.sendall(garbage)
        status, problem = answer_of(connection)
    assert (status, problem["detail"]) == (400, "what came is no HTTP request")


async def test_one_connection_too_many_is_told_503_and_leaves_room_when_it_goes(start_service) -> None:
    service = start_service(max_connections=3)

    def crowd() -> tuple[int, dict]:
        with dial(service), dial(service), dial(service) as third:
            return answer_of(third)

    async with talk(service) as healthy:
        await healthy.start()
        status, problem = await asyncio.to_thread(crowd)
        assert (status, problem["code"], problem["retry_after"]) == (503, "overloaded", 1.0)
        assert len(await healthy.follow(FRAMES)) == len(FRAMES)
    await eventually(lambda: service.service.connections.open == 0)
    async with httpx.AsyncClient(base_url=service.url) as client:
        assert (await client.get("/healthz")).status_code == 200
    assert service.service.connections.refused == 1


def test_beyond_the_margin_nobody_is_told(start_service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor.server.connections.MARGIN", 0)
    service = start_service(max_connections=1)
    with dial(service), dial(service) as second:
        try:
            said = second.recv(1)
        except ConnectionResetError:
            said = b""
    assert said == b""
    assert service.service.connections.refused == 1


def test_a_connection_that_is_kept_has_its_time_anew_for_each_request(start_service) -> None:
    service = start_service(header_timeout_s=0.5)
    request = START.encode() + b"\r\n"
    with dial(service) as connection:
        for _ in range(3):
            connection.sendall(request)
            assert connection.recv(65536).startswith(b"HTTP/1.1 200 ")
        connection.sendall(START.encode())
        assert answer_of(connection)[0] == 408
