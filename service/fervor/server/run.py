"""Runs the service under uvicorn, set up for live streams (measured: docs, "Performance").

A process has one event loop (uvloop), no compression, no Nagle delay. SIGTERM and SIGINT stop it gently: it is no
longer ready, streams get their last checkpoints and 1012, and what else is under way has `shutdown_grace_s` to end.
With more than one worker, a supervisor runs that many such processes on the same address.
"""

import asyncio
import gc
import logging
import resource
import signal
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import NoReturn

import uvicorn

from fervor.errors import FervorError
from fervor.server.app import create_app
from fervor.server.board import Board
from fervor.server.http_protocol import GuardedHttp
from fervor.server.listener import Listener
from fervor.server.logs import configure_logs
from fervor.server.service import Service
from fervor.server.websocket_protocol import GuardedWebSocket
from fervor.settings import Settings

log = logging.getLogger(__name__)

STUCK_S = 20
"""Seconds after which the kernel gives up a connection whose peer takes no bytes."""

OTHER_FILES = 256
"""Open files of the process beside its connections: some of its own, and connections that are being refused."""


class AddressError(FervorError):
    """The address to listen on can't be had."""

    code = "address_in_use"
    exit_code = 69


def say_where(bound: socket.socket) -> None:
    """Log the address of a service that listens."""
    host, port, *_ = bound.getsockname()
    log.info("listening on http://%s:%d", f"[{host}]" if ":" in host else host, port)


class Server(uvicorn.Server):
    """uvicorn, that tells when it listens, and sends streams away in good order.

    Args:
        config: from `configure`.
        on_listening: told each socket once connections to it are taken.
        board: where other workers listen on the same sockets.
        place: of this worker on the board.
        told: set once this process was told to stop, from `end_well`.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        *,
        on_listening: Callable[[socket.socket], None] = say_where,
        board: Board | None = None,
        place: int = 0,
        told: threading.Event | None = None,
    ) -> None:
        super().__init__(config)
        self._told = told
        self._on_listening = on_listening
        self._board = board
        self._place = place

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen."""
        await super().startup(sockets if self._board is None else [])
        if self._told is not None and self._told.is_set():
            self.should_exit = True
            return
        for bound in sockets or []:
            if self._board is not None:
                self.servers.append(self._share(bound, self._board))  # type: ignore[arg-type]  # all that is used of one
            self._on_listening(bound)

    def _share(self, bound: socket.socket, board: Board) -> Listener:
        """Listen on a socket beside other workers."""
        loop = asyncio.get_running_loop()

        def make_protocol() -> asyncio.Protocol:
            return GuardedHttp(
                config=self.config, server_state=self.server_state, app_state=self.lifespan.state, _loop=loop
            )

        service: Service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        return Listener(
            bound,
            self.config.backlog,
            make_protocol,
            connections=service.connections,
            is_full=lambda: service.sessions.full,
            shares=board.shares,
            place=self._place,
        )

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Send the streams away with their last checkpoints, then stop.

        New clients are told to come later (503), but where other workers stay: there they go to those at once.
        """
        if self._board is not None and not self._board.stopping:
            for server in self.servers:
                server.close()
        service: Service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        if not await service.drain.run(service.settings.drain_s):
            log.warning("not every client took its last checkpoint within %g s", service.settings.drain_s)
        await super().shutdown(sockets)


def run(settings: Settings) -> None:
    """Run the service until it is told to stop.

    Raises:
        FervorError: the model or the address can't be used.
    """
    configure_logs(settings.log_format, settings.log_level)
    allow_files(settings.max_connections)
    told = end_well()
    with bind(settings.host, settings.port) as bound:
        if settings.workers == 1:
            server = Server(configure(settings), told=told)
            leave_alone_what_is_loaded()
            server.run(sockets=[bound])
        else:
            from fervor.server.supervisor import Supervisor

            Supervisor(settings, bound, on_serving=say_where).run()


COLLECTED_AFTER = (50_000, 20, 100)
"""Objects more than before after which the collector looks at the new ones; how often, until it looks further back."""


def leave_alone_what_is_loaded() -> None:
    """Have the collector look at what comes from now on, at that only, and seldom.

    Modules and the model stay to the end: it need not walk them beside live streams, and workers go on sharing them.
    What a turn of many sessions makes is gone with the turn, and a session leaves no circles: with Python's own bounds
    every large turn was walked, and every hundredth all bodies, for ten milliseconds.
    """
    gc.freeze()
    gc.set_threshold(*COLLECTED_AFTER)
    gc.enable()  # `fervor serve` loads without it


def end_well() -> threading.Event:
    """Have SIGTERM end this process with exit code 0: to stop when told to is no failure.

    uvicorn takes the signal while it runs, and raises it again once all is done.

    Returns:
        what is set with the signal: where it comes while something loads that passes over every exception, the exit is
        passed over too, and whoever serves then must look here.
    """
    told = threading.Event()

    def end(*_: object) -> NoReturn:
        told.set()
        sys.exit(0)

    signal.signal(signal.SIGTERM, end)
    return told


def configure(settings: Settings) -> uvicorn.Config:
    """How uvicorn serves the application."""
    return uvicorn.Config(
        create_app(settings),
        http=GuardedHttp,
        ws=GuardedWebSocket,
        ws_max_size=settings.max_message_bytes,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=settings.shutdown_grace_s,
        log_config=None,
        log_level=settings.log_level,
        access_log=settings.log_level == "debug",
        server_header=False,
    )


def allow_files(connections: int) -> None:
    """Let the process have as many open files as its connections need, if the system lets it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = connections + OTHER_FILES
    allowed = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < allowed:
        resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, hard))
    if allowed < wanted:
        log.warning("the system allows %d open files; %d connections need %d", allowed, connections, wanted)


def bind(host: str, port: int) -> socket.socket:
    """A socket bound to an address; what is set on it, its connections inherit. It listens once the service is ready.

    Raises:
        AddressError: the address can't be had.
    """
    with ExitStack() as undo:
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            bound = undo.enter_context(socket.socket(family, kind, protocol))
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if hasattr(socket, "TCP_USER_TIMEOUT"):
                bound.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, STUCK_S * 1000)
            bound.bind(address)
        except OSError as error:
            raise AddressError(f"can't listen on {host} port {port}: {error.strerror or error}") from None
        undo.pop_all()
    return bound
