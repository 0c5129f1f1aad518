"""One worker of several: how it leaves."""

import os
import signal
from pathlib import Path

import httpx

import fervor_client
from bodies import motion
from waiting import until
from workers import is_alive, served


def test_a_worker_that_is_told_to_end_leaves_the_address_to_the_others(tmp_path: Path) -> None:
    with served(tmp_path) as service, fervor_client.sync.connect(service.stream) as session:
        session.estimate(motion(1)[0])
        for worker in service.workers():
            os.kill(worker, signal.SIGTERM)
            until(lambda gone=worker: len(service.workers() - {gone}) == 2)
        session.estimate(motion(1)[0])
        assert httpx.get(f"{service.url}/readyz", timeout=30).status_code == 200


def test_workers_do_not_outlive_a_killed_supervisor(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        workers = service.workers()
        service.process.kill()
        until(lambda: not any(is_alive(worker) for worker in workers))
