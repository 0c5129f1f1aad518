"""What tests share: real motion, and a real service."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import get_args

import httpx
import pytest

from fervor.settings import Settings, Transport
from live import Live, running

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder with real motion files; tests that need it are skipped where it is absent, except in CI."""
    if not SHARED_DATA.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"{SHARED_DATA} is absent")
        pytest.skip("the folder with real motion is absent")
    return SHARED_DATA


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the C programs of bench are built once; skips where there is no compiler, except in CI."""
    if shutil.which("cc") is None:
        if os.environ.get("CI"):
            pytest.fail("no C compiler is here")
        pytest.skip("no C compiler is here")
    return tmp_path_factory.mktemp("bench")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Tests of the server that start a service run on both transports."""
    if "transport" in metafunc.fixturenames and metafunc.definition.path.name.startswith("test_server_"):
        metafunc.parametrize("transport", get_args(Transport), indirect=True, scope="session")


@pytest.fixture(scope="session")
def transport(request: pytest.FixtureRequest) -> Transport:
    """How messages get from the socket to their session; the default one unless a test asks for both."""
    chosen: Transport = getattr(request, "param", Settings.model_fields["transport"].default)
    return chosen


@pytest.fixture(scope="session")
def live(transport: Transport) -> Iterator[Live]:
    """A service with the default settings, one for all tests of a transport."""
    with running(max_frames_per_second=1e6, transport=transport) as service:
        yield service


@pytest.fixture
def start_service(transport: Transport) -> Iterator[Callable[..., Live]]:
    """Starts services with settings of their own: `start_service(max_bodies=1)`."""
    with ExitStack() as stack:
        yield lambda **settings: stack.enter_context(running(**{"transport": transport, **settings}))


@pytest.fixture
def http(live: Live) -> Iterator[httpx.Client]:
    """HTTP to the service with the default settings."""
    with httpx.Client(base_url=live.url, timeout=60) as client:
        yield client
