"""What the service loads before it serves, and what it leaves for later."""

import gc
import json
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from pydantic import BaseModel

from fervor.cli.loading import built_when_used, uncollected
from fervor.server.app import create_app
from fervor.settings import Settings
from workers import served

FOR_LATER = (
    "fervor.recordings",
    "fervor.protocol.asyncapi",
    "fervor_client",
    "numpy.random",
    "opentelemetry.sdk",
    "rich",
)
"""Modules that cost a start time, and that only some requests or commands need."""

PROGRAM = """
import json, sys
from fervor.cli.main import run
import fervor.server.run
fervor.server.run.Server.run = lambda *_, **__: print(json.dumps(sorted(sys.modules)))
sys.exit(run(["serve", "--port", "0"]))
"""


def test_the_service_is_loaded_without_what_only_some_need() -> None:
    ran = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60, check=True)
    loaded = set(json.loads(ran.stdout))
    assert "fervor.server.stream" in loaded
    assert not loaded & set(FOR_LATER)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts threads as Linux shows them")
def test_numpy_brings_the_service_no_threads() -> None:
    program = "import os, fervor.cli.serve, numpy; print(len(os.listdir('/proc/self/task')))"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "1"


def test_a_command_runs_with_the_collector_and_the_service_starts_without() -> None:
    program = (
        "import gc, fervor.cli.main, fervor.server.run, sys;"
        "said = lambda *_, **__: print(gc.isenabled(), gc.get_freeze_count() > 10_000);"
        "fervor.server.run.configure, fervor.server.run.Server.run = said, said;"
        "sys.argv = ['fervor', 'serve', '--port', '0']; fervor.server.run.Server.__init__ = lambda *_, **__: None;"
        "fervor.cli.main.main()"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.split("\n")[:2] == ["False True", "True True"]


def test_models_built_when_used_describe_the_same_service(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        answer = httpx.get(f"{service.url}/openapi.json", timeout=60)
    assert answer.json() == json.loads(json.dumps(create_app(Settings.load()).openapi()))


def test_a_model_is_built_when_it_is_first_used() -> None:
    with built_when_used():

        class Late(BaseModel):
            number: int

    class Soon(BaseModel):
        number: int

    assert (Late.__pydantic_complete__, Soon.__pydantic_complete__) == (False, True)
    assert Late(number="3").number == 3
    assert Late.__pydantic_complete__


def test_the_collector_comes_back_whatever_happens() -> None:
    seen: list[bool] = []

    def load() -> None:
        seen.append(gc.isenabled())
        raise OSError("bad")

    with pytest.raises(OSError, match="bad"), uncollected():
        load()
    assert (seen, gc.isenabled()) == ([False], True)
