"""The load script keeps its promise: it passes on a service that is well, and fails on one that is not."""

import subprocess

import pytest

from containers import need, which
from live import Live
from pages import ROOT

THRESHOLDS_CROSSED = 99
"""k6's exit code."""


def load(service: Live, **variables: object) -> int:
    need("k6")
    given = {"URL": service.stream, "SESSIONS": 5, "SECONDS": 2, **variables}
    chosen = [word for name, value in given.items() for word in ("-e", f"{name}={value}")]
    command = [str(which("k6")), "run", "--quiet", "--no-usage-report", *chosen, str(ROOT / "deploy" / "load.js")]
    return subprocess.run(command, check=False, capture_output=True, timeout=90).returncode


@pytest.mark.slow
def test_it_passes_where_every_frame_is_answered(live: Live) -> None:
    assert load(live) == 0


@pytest.mark.slow
def test_it_shows_its_token(start_service) -> None:
    service = start_service(tokens="a token for load")
    assert load(service, TOKEN="a token for load") == 0
    assert load(service) == THRESHOLDS_CROSSED


@pytest.mark.slow
def test_it_fails_where_sessions_are_refused(start_service) -> None:
    assert load(start_service(max_sessions=3)) == THRESHOLDS_CROSSED
