"""Fifty streams through a network and services that fail: every estimate once, in order, equal to the bit.

Two service processes behind a proxy that resets, truncates, delays, throttles, half-opens and refuses connections by a
seeded plan. The services are killed (-9) and stopped (SIGTERM, with a drain) and started again, one after the other, as
long as there is a stream. Each stream is two minutes of a person's time, sent as fast as it goes, by the async client
or the sync one.
"""

import asyncio
import random
import signal
import threading
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress

import pytest

import fervor_client
from bodies import motion
from chaos import FATES, NOTICED_AT_ONCE, Proxy
from fervor_client import Estimate
from live import Live
from program import start_fervor

KEY = "a key for tests that is long enough"
MISFORTUNES = 8
KINDS = 5
RATE_HZ = 8.0  # the model's grid still has 30 steps a second
LABELS = {20: "fear", 45: {"joy": 0.6, "pride": 0.3}, 500: "unknown", 800: "sadness"}
OPTIONS = {"emotion": "joy", "checkpoint_s": 2.0, "retry_for": None, "open_timeout": 10.0}

Told = list[Estimate]


class Replica:
    """A service process that can be killed, stopped and started again, each time on a port of its own."""

    def __init__(self) -> None:
        self.ends: Counter[str] = Counter()
        self.start()

    def start(self) -> None:
        self.process = start_fervor(
            "serve", "--port", "0", "--max-frames-per-second", "1e6", FERVOR_CHECKPOINT_KEYS=KEY
        )
        assert self.process.stderr is not None
        line = next(line for line in self.process.stderr if "listening on http://" in line)
        self.port = int(line.rstrip().rpartition(":")[2])
        self._log = threading.Thread(target=self.process.communicate, daemon=True)
        self._log.start()

    def end(self, how: signal.Signals) -> int:
        self.process.send_signal(how)
        status = self.process.wait(30)
        self._log.join()
        self.ends[how.name] += 1
        return status


@contextmanager
def replicas(proxy: Proxy) -> Iterator[list[Replica]]:
    pair: list[Replica] = []
    try:
        pair += [Replica(), Replica()]
        proxy.targets = [each.port for each in pair]
        yield pair
    finally:
        for each in pair:
            each.process.kill()
            each.process.wait()


class Misfortune(threading.Thread):
    """Ends the services in turn, by kill -9 or by SIGTERM, and starts them again."""

    def __init__(self, pair: list[Replica], proxy: Proxy) -> None:
        super().__init__(daemon=True)
        self.over = threading.Event()
        self.statuses: list[int] = []
        self._pair = pair
        self._proxy = proxy
        self._dice = random.Random(7)

    def run(self) -> None:
        for turn in range(MISFORTUNES):
            if self.over.wait(self._dice.uniform(1.0, 4.0)):
                return
            replica, how = self._pair[turn % 2], (signal.SIGKILL, signal.SIGTERM)[turn // 2 % 2]
            self.statuses.append(replica.end(how))
            replica.start()
            self._proxy.targets[turn % 2] = replica.port


def sync_stream(url: str, kind: int, frames: int) -> tuple[Told, int]:
    while True:  # a first connection is the caller's to try again
        with suppress(fervor_client.Unreachable, fervor_client.Overloaded):
            session = fervor_client.sync.connect(url, **OPTIONS, on_reconnect=lambda _: None)
            break
    with session:
        for seq, pose in enumerate(motion(frames, seed=kind)):
            session.send(pose, t=seq / RATE_HZ, emotion=LABELS.get(seq))
        session.end(timeout=300)
        return list(session), session.reconnects


async def async_stream(url: str, kind: int, frames: int) -> tuple[Told, int]:
    while True:
        with suppress(fervor_client.Unreachable, fervor_client.Overloaded):
            session = await fervor_client.connect(url, **OPTIONS, on_reconnect=lambda _: None)
            break
    async with session:
        for seq, pose in enumerate(motion(frames, seed=kind)):
            await session.send(pose, t=seq / RATE_HZ, emotion=LABELS.get(seq))
        await session.end(timeout=300)
        return [estimate async for estimate in session], session.reconnects


async def all_streams(url: str, *, sync: int, streams: int, frames: int) -> list[tuple[Told, int]]:
    """`streams` streams at once, `sync` of them by the client for threads."""
    loop = asyncio.get_running_loop()
    with ThreadPoolExecutor(sync) as threads:
        by_threads = [loop.run_in_executor(threads, sync_stream, url, n % KINDS, frames) for n in range(sync)]
        by_tasks = [async_stream(url, n % KINDS, frames) for n in range(sync, streams)]
        return await asyncio.gather(*by_threads, *by_tasks)


def check(got: list[tuple[Told, int]], live: Live, frames: int) -> None:
    """Each stream is what it is on a service and a network that are well."""
    expected = [sync_stream(live.stream, kind, frames)[0] for kind in range(KINDS)]
    for number, (told, _) in enumerate(got):
        assert [estimate.seq for estimate in told] == list(range(frames)), f"stream {number}: each once, in order"
        assert told == expected[number % KINDS], f"stream {number}: to the bit"


def test_streams_through_a_network_that_fails(live: Live, start_service) -> None:
    """The small one, which always runs: two services that live, and connections that don't."""
    proxy = Proxy(seed=3, lives=(2_000, 40_000), fates=NOTICED_AT_ONCE)
    proxy.targets = [
        int(start_service(checkpoint_keys=KEY, max_frames_per_second=1e6).address.rpartition(":")[2]) for _ in range(2)
    ]
    try:
        got = asyncio.run(all_streams(proxy.url, sync=2, streams=8, frames=80))
    finally:
        proxy.close()
    check(got, live, 80)
    assert sum(reconnects for _, reconnects in got) > 8
    assert {"resets", "ends"} <= set(proxy.met)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_fifty_streams_of_minutes_lose_nothing(live: Live) -> None:
    frames = int(RATE_HZ * 120)
    proxy = Proxy(seed=11, lives=(20_000, 600_000))
    with replicas(proxy) as pair:
        misfortune = Misfortune(pair, proxy)
        misfortune.start()
        try:
            got = asyncio.run(all_streams(proxy.url, sync=10, streams=50, frames=frames))
        finally:
            misfortune.over.set()
            misfortune.join()
            proxy.close()
    check(got, live, frames)
    ends = pair[0].ends + pair[1].ends
    assert ends["SIGKILL"] >= 2
    assert ends["SIGTERM"] >= 2
    assert {-signal.SIGKILL, -signal.SIGTERM, 0} >= set(misfortune.statuses), "a service that is told to stop ends well"
    assert set(proxy.met) == set(FATES), "everything that can happen has happened"
    assert sum(reconnects for _, reconnects in got) > 50
