"""`make image`: what the container image weighs, and how long a container takes from `docker run` to `/readyz`.

It needs Docker's command line and nothing else, so that it runs wherever the image is built.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from pathlib import Path

RUNS = 5

PATIENCE_S = 120.0
"""Longest wait for a container."""

OURS = "COPY /opt/fervor"
"""The one layer of the Dockerfile that is not its base."""

AS_DEPLOYED = ("--read-only", "--tmpfs", "/tmp", "--cap-drop", "ALL", "--security-opt", "no-new-privileges")
"""As in compose.yaml."""


@dataclass(frozen=True, slots=True)
class Weight:
    """What an image weighs, bytes on disk."""

    whole: int
    ours: int
    """Over its base."""


@dataclass(frozen=True, slots=True)
class ColdStart:
    """One container's start."""

    ready_s: float
    """From `docker run` to the first good answer of `/readyz`."""
    processor_s: float | None
    """Processor time of the service until then; None where its process can't be seen from here."""


def weigh(image: str) -> Weight:
    """The weight of an image."""
    layers = _docker("history", "--no-trunc", "--human=false", "--format", "{{.Size}}\t{{.CreatedBy}}", image)
    sizes = [(int(size), made_by) for size, _, made_by in (line.partition("\t") for line in layers.splitlines())]
    return Weight(
        whole=int(_docker("image", "inspect", "--format", "{{.Size}}", image)),
        ours=sum(size for size, made_by in sizes if made_by.startswith(OURS)),
    )


def start(image: str) -> ColdStart:
    """Run a container until it is ready, and remove it."""
    begun = time.perf_counter()
    container = _docker("run", "--detach", *AS_DEPLOYED, "--publish", "127.0.0.1::8080", image)
    try:
        host, _, port = _docker("port", container, "8080").splitlines()[0].rpartition(":")
        while not _is_ready(host, int(port)):
            if time.perf_counter() - begun > PATIENCE_S:
                sys.exit(f"the container was not ready after {PATIENCE_S:g} s: {_docker('logs', container)}")
            time.sleep(0.01)
        ready_s = time.perf_counter() - begun
        return ColdStart(ready_s, _processor_seconds(int(_docker("inspect", "--format", "{{.State.Pid}}", container))))
    finally:
        _docker("rm", "--force", container)


def _is_ready(host: str, port: int) -> bool:
    connection = HTTPConnection(host, port, timeout=2.0)
    try:
        connection.request("GET", "/readyz")
        return connection.getresponse().status == 200
    except (OSError, HTTPException):  # Docker's proxy takes connections before the service does
        return False
    finally:
        connection.close()


def _processor_seconds(pid: int) -> float | None:
    try:
        after_name = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return None
    return (int(after_name[11]) + int(after_name[12])) / os.sysconf("SC_CLK_TCK")


def _docker(*arguments: str) -> str:
    program = os.environ.get("DOCKER", "docker")
    done = subprocess.run([program, *arguments], check=False, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{program} {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout.strip()


def _spread(seconds: list[float]) -> str:
    return f"median {statistics.median(seconds):.2f}, least {min(seconds):.2f}, most {max(seconds):.2f}"


def main(arguments: list[str]) -> None:
    """Weigh, start, and print both."""
    parser = argparse.ArgumentParser(prog="python -m bench.image", description=__doc__)
    parser.add_argument("image", nargs="?", default="fervor")
    parser.add_argument("--runs", type=int, default=RUNS)
    chosen = parser.parse_args(arguments)
    weight = weigh(chosen.image)
    print(f"image {chosen.image}: {weight.whole / 1e6:.0f} MB, of which {weight.ours / 1e6:.0f} MB over its base")
    starts = [start(chosen.image) for _ in range(chosen.runs)]
    load = os.getloadavg()[0]
    print(f"docker run to ready, {chosen.runs} times, seconds: {_spread([one.ready_s for one in starts])}")
    if used := [one.processor_s for one in starts if one.processor_s is not None]:
        print(f"processor time of that, seconds: {_spread(used)}; the machine's load meanwhile: {load:.1f}")


if __name__ == "__main__":
    main(sys.argv[1:])
