"""The listening socket that workers share: several listeners on one socket, as workers have them."""

import asyncio
import errno
import socket
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from fervor.server.connections import Connections
from fervor.server.listener import Listener
from fervor.server.run import bind
from fervor.server.shares import Shares

PLACES = 3


class Guest(asyncio.Protocol):
    """A connection that does nothing."""

    def __init__(self, connections: Connections, guests: set["Guest"]) -> None:
        self.connections = connections
        self.guests = guests

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport
        self.guests.add(self)
        self.connections.enter(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        self.connections.leave(self.transport)


class Worker:
    """What one worker has of it."""

    def __init__(self, bound: socket.socket, shares: Shares, place: int) -> None:
        self.bound = bound
        self.connections = Connections(1000)
        self.guests: set[Guest] = set()
        self.full = False
        self.listener = Listener(
            bound,
            100,
            lambda: Guest(self.connections, self.guests),
            connections=self.connections,
            is_full=lambda: self.full,
            shares=shares,
            place=place,
        )

    @property
    def open(self) -> int:
        return self.connections.open


class Stage:
    """A socket, the workers that listen on it, and clients."""

    def __init__(self, bound: socket.socket) -> None:
        self.bound = bound
        self.shares = Shares(PLACES)
        self.workers: list[Worker] = []
        self.clients: list[asyncio.StreamWriter] = []

    def add_worker(self, bound: socket.socket | None = None) -> Worker:
        """One more; it has the socket under a number of its own, as another process would."""
        self.workers.append(Worker(bound or self.bound.dup(), self.shares, len(self.workers)))
        return self.workers[-1]

    @property
    def opened(self) -> list[int]:
        return [worker.open for worker in self.workers]

    async def come(self, count: int) -> None:
        """Clients, all at once; returns once each was taken."""
        expected = sum(self.opened) + count
        address = self.bound.getsockname()
        pairs = await asyncio.gather(*(asyncio.open_connection(*address) for _ in range(count)))
        self.clients += [writer for _, writer in pairs]
        await seen(lambda: sum(self.opened) == expected)

    async def end(self) -> None:
        for client in self.clients:
            client.close()
        for worker in self.workers:
            worker.listener.close()
            await worker.listener.wait_closed()
            worker.bound.close()
        await seen(lambda: not any(self.opened))


async def seen(look: Callable[[], bool]) -> None:
    async with asyncio.timeout(30):
        while not look():
            await asyncio.sleep(0.001)


@pytest.fixture
async def stage(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Stage]:
    """Its workers are not taken for dead where this whole process is not let run for a while."""
    monkeypatch.setattr("fervor.server.shares.PATIENCE_S", 60.0)
    with bind("127.0.0.1", 0) as bound:
        stage = Stage(bound)
        yield stage
        await stage.end()


async def test_connections_fall_to_all_alike(stage: Stage) -> None:
    for _ in range(3):
        stage.add_worker()
    await stage.come(60)
    assert stage.opened == [20, 20, 20]


async def test_who_has_fewer_takes_all_until_it_has_as_many(stage: Stage) -> None:
    stage.add_worker()
    await stage.come(30)
    stage.add_worker()
    await stage.come(20)
    assert stage.opened == [30, 20]
    await stage.come(20)
    assert stage.opened == [35, 35]


async def test_who_is_full_leaves_them_to_others_but_where_all_are(stage: Stage) -> None:
    one, two = stage.add_worker(), stage.add_worker()
    one.full = True
    await stage.come(10)
    assert stage.opened == [0, 10]
    two.full = True
    await stage.come(10)
    assert sum(stage.opened) == 20


async def test_who_closed_is_not_waited_for(stage: Stage) -> None:
    one, two = stage.add_worker(), stage.add_worker()
    await stage.come(2)
    two.listener.close()
    await stage.come(10)
    assert stage.opened == [11, 1]
    for guest in two.guests:
        guest.transport.abort()
    await seen(lambda: two.open == 0)
    assert stage.shares.fewest_of_others(0) is None, "it came back when a connection of it ended"
    await stage.come(1)
    assert one.open == 12


async def test_who_is_silent_is_waited_for_a_moment_only(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor.server.shares.PATIENCE_S", 0.1)
    stage.add_worker()
    stage.shares.tell(2, 0)  # and never again
    await stage.come(5)
    assert stage.opened == [5]


async def test_where_no_more_files_may_be_open_the_others_take_over(
    stage: Stage, caplog: pytest.LogCaptureFixture
) -> None:
    class Short(socket.socket):
        """A listening socket in a process that has no file left."""

        def accept(self) -> Any:
            raise OSError(errno.EMFILE, "Too many open files")

    stage.add_worker(Short(fileno=stage.bound.dup().detach()))
    await seen(lambda: stage.shares.fewest_of_others(1) == 0)
    stage.add_worker()
    await stage.come(5)
    assert stage.opened == [0, 5]
    assert "no connection could be taken: Too many open files" in caplog.text
