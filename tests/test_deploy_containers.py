"""The image and compose.yaml, for real: what runs in the container, and what a stream notices of its end: nothing."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from bodies import motion
from containers import (
    NEEDED,
    PYTHON_IMAGE,
    Compose,
    Docker,
    make_images,
    need,
    need_root,
    roomy_folder,
    running_docker,
    which,
)
from crowd import Robots, assert_told_as_if_nothing_had_happened
from fervor.cli.local import free_port
from fervor.server.watch_messages import SUBPROTOCOL
from fervor.settings import ENV_PREFIX, MIB
from live import PROTOCOL, Live, frames_of
from pages import ROOT
from program import write_bvh
from waiting import until

MOST_MB = 220
"""Megabytes that the service may add to its base image."""

FEW_ROBOTS = 4

SECRETS = "compose.secrets.yaml"

SECRET_FILES = ("--file", "compose.yaml", "--file", f"deploy/{SECRETS}")


@pytest.fixture(scope="module")
def docker() -> Iterator[Docker]:
    """A daemon with all images but Grafana's."""
    need_root()
    need(*NEEDED)
    with roomy_folder() as folder, running_docker(folder) as docker:
        make_images(docker, folder)
        yield docker


def sessions(docker: Docker, container: str) -> int:
    """How many a service has."""
    text = httpx.get(f"http://{docker.address(container)}:8080/metrics", timeout=30).text
    return round(float(re.findall(r"^fervor_sessions (\S+)", text, re.MULTILINE)[0]))


# --- files ------------------------------------------------------------------------------------------------------------


def test_the_dockerfile_has_no_lint() -> None:
    need("hadolint")
    done = subprocess.run([str(which("hadolint")), "Dockerfile"], cwd=ROOT, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_compose_starts_the_service_alone_unless_asked_for_more() -> None:
    need("docker-compose")

    def services(*profiles: str) -> set[str]:
        chosen = [word for profile in profiles for word in ("--profile", profile)]
        command = [str(which("docker-compose")), *chosen, "config", "--services"]
        return set(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split())

    assert services() == {"fervor"}
    assert services("replicas") == {"fervor", "replica", "haproxy"}
    assert services("watch") == {"fervor", "prometheus", "grafana"}


def composed(*options: str, **variables: str) -> dict[str, Any]:
    """What Compose makes of its files, with all profiles."""
    need("docker-compose")
    command = [str(which("docker-compose")), *options, "--profile", "*", "config", "--format", "json"]
    clean = {name: value for name, value in os.environ.items() if not name.startswith(ENV_PREFIX)}
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, env={**clean, **variables})
    made: dict[str, Any] = json.loads(done.stdout)["services"]
    return made


def test_without_tokens_no_other_machine_gets_in() -> None:
    services = composed()
    opened = [port for service in services.values() for port in service.get("ports", ())]
    assert len(opened) == 3
    assert {port["host_ip"] for port in opened} == {"127.0.0.1"}
    (port,) = composed(FERVOR_PUBLISH="8080")["fervor"]["ports"]
    assert "host_ip" not in port


def test_secrets_come_from_files_for_all_that_serve() -> None:
    services = composed(*SECRET_FILES)
    for service in (services["fervor"], services["replica"]):
        mounted = {f"/run/secrets/{secret['source']}" for secret in service["secrets"]}
        environment = service["environment"]
        assert mounted == {environment["FERVOR_TOKENS_FILE"], environment["FERVOR_CHECKPOINT_KEYS_FILE"]}
        assert not environment["FERVOR_CHECKPOINT_KEYS"], "two homes of the keys are an error"


# --- the image --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_image_is_small_and_without_torch(docker: Docker) -> None:
    added = (docker.inspect("fervor")["Size"] - docker.inspect(PYTHON_IMAGE)["Size"]) / 1e6
    print(f"the service adds {added:.0f} MB to {PYTHON_IMAGE}")
    assert added < MOST_MB
    search = "from importlib.util import find_spec as f; print([m for m in ('torch', 'onnx', 'pip', 'pytest') if f(m)])"
    path = "/opt/fervor/bin/python"
    assert docker("run", "--rm", "--entrypoint", path, "fervor", "-I", "-c", search) == "[]"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_weight_and_the_cold_start_are_reported(docker: Docker) -> None:
    before = docker("ps", "--all", "--quiet")
    done = subprocess.run(
        [sys.executable, "-m", "bench.image", "fervor", "--runs", "2"], cwd=ROOT, check=True, capture_output=True,
        text=True, env={**docker.environment, "DOCKER": docker.program},
    )  # fmt: skip
    whole, over_base = map(int, re.findall(r"(\d+) MB", done.stdout))
    added = (docker.inspect("fervor")["Size"] - docker.inspect(PYTHON_IMAGE)["Size"]) / 1e6
    assert whole == round(docker.inspect("fervor")["Size"] / 1e6)
    assert over_base == pytest.approx(added, abs=2)
    assert "docker run to ready, 2 times, seconds: median " in done.stdout
    assert docker("ps", "--all", "--quiet") == before


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_container_may_do_nothing_but_serve(docker: Docker, tmp_path: Path) -> None:
    with Compose(docker, "alone", FERVOR_PUBLISH=f"127.0.0.1:{free_port()}").up() as compose:
        (container,) = compose.containers("fervor")
        assert docker.inspect(container)["State"]["Health"]["Status"] == "healthy"
        for status in docker(
            "exec", container, "sh", "-c", "for p in /proc/[1-9]*; do cat $p/status; echo ==; done"
        ).split("==")[:-1]:
            said = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
            assert set(said["Uid"].split()) == {"65532"}
            assert {said[name] for name in ("CapEff", "CapPrm", "CapBnd")} == {"0" * 16}
            assert said["NoNewPrivs"] == "1"
        assert "Read-only file system" in docker("exec", container, "sh", "-c", "touch /x 2>&1 || true")
        large = write_bvh(tmp_path / "large.bvh", seconds=60.0)
        assert large.stat().st_size > MIB  # above which an upload is put into a file
        url = f"http://{docker.address(container)}:8080/v1/score/file"
        answer = httpx.post(url, files={"file": (large.name, large.read_bytes())}, timeout=120)
        assert answer.status_code == 200, answer.text
        assert docker("exec", container, "find", "/tmp", "-type", "f") == ""
        assert docker("exec", container, "stat", "--file-system", "--format", "%T", "/tmp") == "tmpfs"


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("workers", [1, 2])
def test_sigterm_gives_last_checkpoints_and_ends_with_0(docker: Docker, workers: int) -> None:
    container = docker(
        "run", "--detach", "--read-only", "--cap-drop", "ALL", "-e", f"FERVOR_WORKERS={workers}", "fervor"
    )
    docker.wait_healthy(container)
    heard: list[dict[str, Any]] = []
    with connect(f"ws://{docker.address(container)}:8080/v1/stream", subprotocols=[PROTOCOL]) as socket:
        socket.send(json.dumps({"type": "session.start", "checkpoint_s": 60.0}))
        for frame in frames_of(motion(3)):
            socket.send(json.dumps({"type": "frame", "body": "eve", **frame}))
        while sum(message["type"] == "estimate" for message in heard) < 3:
            heard.append(json.loads(socket.recv()))
        docker("stop", "--time", "20", container)
        with suppress(ConnectionClosed):
            while True:
                heard.append(json.loads(socket.recv()))
        assert socket.close_code == 1012
    assert [message["type"] for message in heard[-2:]] == ["going_away", "checkpoint"]
    assert heard[-1]["seq"] == 2
    assert docker.inspect(container)["State"]["ExitCode"] == 0
    assert "Traceback" not in docker.logs(container)


# --- secrets ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def secrets(tmp_path: Path) -> Path:
    """A folder of the operator alone, with the files that deploy/compose.secrets.yaml wants."""
    folder = tmp_path / "secrets"
    folder.mkdir(mode=0o700)
    for name, text in (("tokens", "robot-7 alpha\n"), ("checkpoint-keys", "a-key-of-more-than-sixteen-characters\n")):
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def says(address: str, path: str, subprotocol: str, token: str | None) -> str:
    """The type of the first message to who asks with a token, or the status of the refusal."""
    shown = [] if token is None else [f"fervor.token.{token}"]
    try:
        with connect(f"ws://{address}{path}", subprotocols=[subprotocol, *shown]) as socket:
            if path.endswith("stream"):
                socket.send(json.dumps({"type": "session.start"}))
            return str(json.loads(socket.recv())["type"])
    except InvalidStatus as refused:
        return str(refused.response.status_code)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_files_of_tokens_guard_streams_and_page_and_may_change(docker: Docker, secrets: Path) -> None:
    address = f"127.0.0.1:{free_port()}"
    variables = {"FERVOR_PUBLISH": address, "FERVOR_SECRETS": secrets}
    with Compose(docker, "guarded", file=SECRETS, **variables).up() as compose:
        assert httpx.get(f"http://{address}/", timeout=30).status_code == 200, "the page, which asks for the token"
        for path, subprotocol, first in (
            ("/v1/stream", PROTOCOL, "session.started"),
            ("/v1/watch", SUBPROTOCOL, "watch.started"),
        ):
            assert says(address, path, subprotocol, None) == "401"
            assert says(address, path, subprotocol, "beta") == "401"
            assert says(address, path, subprotocol, "alpha") == first
        with (secrets / "tokens").open("a", encoding="utf-8") as file:
            file.write("robot-8 beta\n")
        until(lambda: says(address, "/v1/stream", PROTOCOL, "beta") == "session.started")
        assert says(address, "/v1/stream", PROTOCOL, "alpha") == "session.started"
        (container,) = compose.containers("fervor")
        told = json.dumps(docker.inspect(container)) + docker.logs(container)
        assert not any(secret in told for secret in ("alpha", "beta", "more-than-sixteen"))


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("missing", ["tokens", "checkpoint-keys"])
def test_without_a_file_of_secrets_nothing_starts(docker: Docker, secrets: Path, missing: str) -> None:
    (secrets / missing).unlink()
    variables = {"FERVOR_PUBLISH": f"127.0.0.1:{free_port()}", "FERVOR_SECRETS": secrets}
    compose = Compose(docker, "unguarded", file=SECRETS, **variables)
    with pytest.raises(AssertionError, match=missing), compose.up():
        pass
    assert not (secrets / missing).exists(), "a folder in its place would be no help"


# --- replicas ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def replicas(docker: Docker) -> Iterator[tuple[Compose, str]]:
    """Two replicas behind haproxy, and the address of both."""
    port = free_port()
    variables = {"FERVOR_PUBLISH": f"127.0.0.1:{free_port()}", "FERVOR_PUBLISH_REPLICAS": f"127.0.0.1:{port}"}
    with Compose(docker, "replicas", "replicas", **variables).up() as compose:
        url = f"http://127.0.0.1:{port}"
        until(lambda: ready(url))
        yield compose, f"ws://127.0.0.1:{port}"


def ready(url: str) -> bool:
    try:
        return httpx.get(f"{url}/readyz", timeout=30).status_code == 200
    except httpx.TransportError:
        return False


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_robots_are_spread_and_killed_containers_cost_them_nothing(
    docker: Docker, replicas: tuple[Compose, str], live: Live
) -> None:
    compose, url = replicas
    both = compose.containers("replica")
    assert len(both) == 2
    assert httpx.get(f"{url.replace('ws', 'http', 1)}/metrics").status_code == 404, "metrics are for the inside"
    with Robots(url, FEW_ROBOTS) as robots:
        assert [sessions(docker, container) for container in both] == [FEW_ROBOTS / 2] * 2
        for container in both:  # each robot is with one of them
            docker("kill", "--signal", "KILL", container)
            robots.settle()
            docker("start", container)
            docker.wait_healthy(container)
            robots.settle()
    assert all(robots.reconnects)
    assert_told_as_if_nothing_had_happened(robots, live.stream)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_rolling_restart_of_all_replicas_costs_robots_nothing(
    docker: Docker, replicas: tuple[Compose, str], live: Live
) -> None:
    compose, url = replicas
    with Robots(url, FEW_ROBOTS) as robots:
        for container in compose.containers("replica"):
            docker("restart", "--time", "20", container)
            docker.wait_healthy(container)
            robots.settle()
    assert all(robots.reconnects)
    assert_told_as_if_nothing_had_happened(robots, live.stream)


# --- watching ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_prometheus_finds_the_service_and_reads_its_metrics(docker: Docker) -> None:
    variables = {"FERVOR_PUBLISH": f"127.0.0.1:{free_port()}"}
    with Compose(docker, "watch", "watch", **variables).up("fervor", "prometheus") as compose:
        (container,) = compose.containers("prometheus")
        checked = docker("exec", container, "promtool", "check", "config", "/etc/prometheus/prometheus.yml")
        assert "SUCCESS" in checked
        api = f"http://{docker.address(container)}:9090/api/v1/query"

        def asked() -> list[dict[str, Any]]:
            try:
                found: list[dict[str, Any]] = httpx.get(api, params={"query": "fervor_bodies_capacity"}).json()["data"][
                    "result"
                ]
            except httpx.TransportError:
                return []
            return found

        (metric,) = until(asked)
        assert metric["metric"]["job"] == "fervor"
        assert float(metric["value"][1]) > 0
