"""Traces, by OpenTelemetry: one span a request and one a session, none a frame.

Off unless OTEL_EXPORTER_OTLP_ENDPOINT says where to send them. That name, and all others that begin with OTEL_, are
OpenTelemetry's own, and are read by its SDK. No span holds a token: queries and headers are left out.
"""

import os
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI

from fervor import __version__
from fervor.settings import SettingsError

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.trace import Span

ENDPOINT = "OTEL_EXPORTER_OTLP_ENDPOINT"

NOT_TRACED = "healthz,readyz,metrics,v1/stream"
"""Probes are noise, and a stream has a span of its own."""

_QUERIES = ("http.url", "http.target", "url.full", "url.query")


class Tracing:
    """Where spans go; nowhere, without a provider."""

    def __init__(self, provider: "TracerProvider | None" = None) -> None:
        self._provider = provider
        self._tracer = None if provider is None else provider.get_tracer("fervor", __version__)

    @classmethod
    def from_environment(cls) -> "Tracing":
        """Traces to where the environment says.

        Raises:
            SettingsError: it says where, but OpenTelemetry is not installed.
        """
        if not os.environ.get(ENDPOINT):
            return cls()
        try:
            from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
            from opentelemetry.sdk.resources import Resource
            from opentelemetry.sdk.trace import TracerProvider
            from opentelemetry.sdk.trace.export import BatchSpanProcessor
        except ModuleNotFoundError:
            raise SettingsError(
                f'{ENDPOINT} is set, but no tracing is installed: pip install "fervor[trace]"'
            ) from None
        resource = Resource.create({"service.name": os.environ.get("OTEL_SERVICE_NAME", "fervor")})
        provider = TracerProvider(resource=resource)
        provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
        return cls(provider)

    def watch(self, app: FastAPI) -> None:
        """Make a span of every request to `app`."""
        if self._provider is None:
            return
        from opentelemetry.instrumentation.asgi import OpenTelemetryMiddleware
        from opentelemetry.util.http import parse_excluded_urls

        app.add_middleware(
            OpenTelemetryMiddleware,
            tracer_provider=self._provider,
            excluded_urls=parse_excluded_urls(NOT_TRACED),
            exclude_spans=["receive", "send"],
            server_request_hook=_leave_out_query,
        )

    def note_session(self, seconds: float, about: Mapping[str, str | int | float]) -> None:
        """A session is over that lasted so long."""
        if self._tracer is not None:
            now = time.time_ns()
            attributes = {f"fervor.{name}": value for name, value in about.items()}
            self._tracer.start_span("session", start_time=now - int(seconds * 1e9), attributes=attributes).end(now)

    def close(self) -> None:
        """Send what is left."""
        if self._provider is not None:
            self._provider.shutdown()


def _leave_out_query(span: "Span", scope: Mapping[str, Any]) -> None:
    for name in _QUERIES:
        if (value := getattr(span, "attributes", {}).get(name)) is not None:
            span.set_attribute(name, str(value).partition("?")[0] if name != "url.query" else "")
    span.update_name(f"{scope['method']} {scope['path']}")
