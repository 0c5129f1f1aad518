"""The `fervor` program with two workers or more, seen from outside."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
from prometheus_client.parser import text_string_to_metric_families

from program import FERVOR
from waiting import until


class Served:
    """The program with its workers."""

    def __init__(self, process: "subprocess.Popen[bytes]", log: Path) -> None:
        self.process = process
        self._log = log
        self.address = self.wait_for("listening on http://").rpartition("http://")[2]
        self.url = f"http://{self.address}"
        self.stream = f"ws://{self.address}/v1/stream"

    @property
    def said(self) -> list[str]:
        return self._log.read_text(encoding="utf-8").splitlines()

    def wait_for(self, words: str) -> str:
        return until(lambda: next((line for line in self.said if words in line), ""))

    def workers(self) -> set[int]:
        """Their process numbers."""
        text = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text(encoding="ascii")
        return {int(number) for number in text.split()}

    def sessions(self) -> dict[str, float]:
        """How many are open, by worker."""
        text = httpx.get(f"{self.url}/metrics", timeout=30).text
        return {
            sample.labels["worker"]: sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
            if sample.name == "fervor_sessions"
        }


@contextmanager
def served(folder: Path, *options: str, workers: int = 2) -> Iterator[Served]:
    """The program, serving; its log goes into `folder`."""
    log = folder / "log"
    command = [FERVOR, "serve", "--port", "0", "--workers", str(workers), *options]
    with log.open("wb") as said, subprocess.Popen(command, stderr=said) as process:
        try:
            yield Served(process, log)
        finally:
            process.kill()


def is_alive(number: int) -> bool:
    with suppress(OSError):
        return "zombie" not in Path(f"/proc/{number}/status").read_text(encoding="ascii")
    return False
