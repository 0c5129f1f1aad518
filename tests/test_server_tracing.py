"""Traces reach a collector over the real protocol: requests and sessions, and nothing that is secret or too fine."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from bodies import motion
from fervor.server.tracing import ENDPOINT, Tracing
from fervor.settings import Settings, SettingsError
from live import frames_of, running, talk


class Collector:
    """As much of an OpenTelemetry collector as takes spans."""

    def __init__(self, address: str) -> None:
        self.endpoint = f"http://{address}"
        self.received = b""
        self.requests: list[ExportTraceServiceRequest] = []

    @property
    def spans(self) -> dict[str, dict[str, object]]:
        """Attributes by name."""
        return {
            span.name: {pair.key: pair.value for pair in span.attributes}
            for request in self.requests
            for resource in request.resource_spans
            for scope in resource.scope_spans
            for span in scope.spans
        }


@pytest.fixture
def collector() -> Iterator[Collector]:
    with collecting() as found:
        yield found


@contextmanager
def collecting() -> Iterator[Collector]:
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            request = ExportTraceServiceRequest()
            request.ParseFromString(body)
            found.received += body
            found.requests.append(request)
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        found = Collector("{}:{}".format(*server.server_address))
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield found
        server.shutdown()
        thread.join()


async def test_requests_and_sessions_are_traced(collector: Collector, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENDPOINT, collector.endpoint)
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_COMPRESSION", "none")
    with running(tokens="s3cret") as service:
        headers = {"Authorization": "Bearer s3cret"}
        async with httpx.AsyncClient(base_url=service.url, headers=headers) as client:
            assert (await client.get("/v1/model?token=s3cret")).status_code == 200
            assert (await client.get("/healthz")).status_code == 200
        async with talk(service, additional_headers=headers) as stream:
            await stream.start()
            await stream.follow(frames_of(motion(20)))
            await stream.send("session.end")
            await stream.closed()
    assert set(collector.spans) == {"GET /v1/model", "session"}
    session = collector.spans["session"]
    assert session["fervor.estimates"].int_value == 20
    assert session["fervor.reason"].string_value == "ended"
    assert collector.spans["GET /v1/model"]
    assert b"s3cret" not in collector.received
    assert b"fervor" in collector.received


def test_it_is_off_unless_the_environment_says_where(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(ENDPOINT, raising=False)
    assert Tracing.from_environment()._provider is None


def test_without_the_library_the_start_ends_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENDPOINT, "http://127.0.0.1:1")
    monkeypatch.setitem(__import__("sys").modules, "opentelemetry.sdk.resources", None)
    with pytest.raises(SettingsError, match=r"pip install \"fervor\[trace\]\""):
        Tracing.from_environment()
    assert Settings.load()
