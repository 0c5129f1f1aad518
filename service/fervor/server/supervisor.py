"""Several workers on one address (`--workers`), and a process that only watches over them.

Rules.
- The first worker starts alone: what is wrong with settings or model is said once, and ends the start.
- A worker that ends unasked is replaced at once; one that could not even start is tried again after `RETRY_S`. One
  whose event loop has not turned for `STUCK_S` is killed: its clients are better off on another.
- SIGTERM and SIGINT stop all workers at the same time; a second SIGINT does not wait for them. SIGHUP replaces the
  workers one after another, each by one that serves already: no moment without a worker, no stream lost.
- Workers are forked from this process, which holds no model and runs no thread: what it has loaded, they share.

Why not uvicorn's supervisor: its workers outlive it when it is killed, share no memory, and know nothing of drains.
"""

import logging
import multiprocessing
import os
import secrets
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from time import monotonic

from pydantic import SecretStr

from fervor.server.board import Board
from fervor.server.run import leave_alone_what_is_loaded
from fervor.server.worker import Worker
from fervor.settings import Settings

log = logging.getLogger(__name__)

RETRY_S = 1.0
"""Pause before a worker that could not start is tried again."""

STUCK_S = 10.0
"""Silence after which a worker counts as stuck; each shows its metrics twice a second."""

LOOK_S = 2.0
"""How often the supervisor looks for stuck workers."""

FAULT = 70
"""Exit code where the first worker was killed before it served (EX_SOFTWARE)."""

_FORK = multiprocessing.get_context("fork")
_HEARD = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(slots=True, eq=False)
class Member:
    """A worker, seen from here."""

    place: int
    process: ForkProcess
    ready: Connection
    serves: bool = False
    leaves: bool = False


class Supervisor:
    """Keeps `settings.workers` workers alive on one bound socket."""

    def __init__(
        self, settings: Settings, bound: socket.socket, *, on_serving: Callable[[socket.socket], None]
    ) -> None:
        self._settings = with_key(settings)
        self._bound = bound
        self._on_serving = on_serving
        self._serving = False
        self._members: list[Member] = []
        self._outdated: list[Member] = []
        self._replaced: Member | None = None
        self._retry_at: float | None = None
        self._stopped_by: int | None = None
        self._looked = monotonic()
        self._board = Board(settings.workers + 1)  # one more: while a worker is replaced there are two
        self._life, self._hold = os.pipe()

    def run(self) -> None:
        """Run until told to stop.

        Raises:
            KeyboardInterrupt: stopped by Ctrl-C.
            SystemExit: the first worker could not start.
        """
        leave_alone_what_is_loaded()
        with heard_signals() as heard:
            self._fill_up()
            while self._members or self._stopped_by is None:
                self._attend(heard)
                self._fill_up()
        if self._stopped_by == signal.SIGINT:
            raise KeyboardInterrupt

    def _attend(self, heard: socket.socket) -> None:
        """Wait until something happens, and note it."""
        ready = [member.ready for member in self._members if not member.serves]
        ends = [member.process.sentinel for member in self._members]
        pause = LOOK_S if self._retry_at is None else min(max(self._retry_at - monotonic(), 0.0), LOOK_S)
        happened = wait([heard, *ready, *ends], pause)
        if heard in happened:
            for number in heard.recv(4096):
                self._note_signal(number)
        for member in list(self._members):
            if member.ready in happened:
                self._note_ready(member)
            if member.process.sentinel in happened:
                self._note_end(member)
        self._look()

    # --- what happens ---

    def _look(self) -> None:
        """Kill who is stuck."""
        since, self._looked = monotonic() - self._looked, monotonic()
        if since > 2 * LOOK_S:  # this process was not let run either: the machine slept, or all are short of time
            return
        for member in self._staying():
            if member.serves and self._board.age(member.place) > STUCK_S:
                log.error("worker %d (process %d) is stuck; killing it", member.place, member.process.pid)
                member.process.kill()

    def _note_signal(self, number: int) -> None:
        if number == signal.SIGHUP:
            self._outdated = [member for member in self._members if not member.leaves]
        elif self._stopped_by is None:
            self._stopped_by = number
            self._board.stop()
            for member in self._members:
                send_away(member)
        elif number == signal.SIGINT:
            for member in self._members:
                member.process.kill()

    def _note_ready(self, member: Member) -> None:
        try:
            member.serves = member.ready.recv() == "serves"
        except EOFError:  # it is about to end, of which the sentinel will tell
            return
        serving = [other for other in self._staying() if other.serves]
        if len(serving) == self._settings.workers and not self._serving:
            self._serving = True
            self._on_serving(self._bound)
        if self._replaced is not None and len(serving) > self._settings.workers:
            send_away(self._replaced)

    def _note_end(self, member: Member) -> None:
        member.process.join()
        member.ready.close()
        code = member.process.exitcode
        self._members.remove(member)
        self._board.clear(member.place)
        if member is self._replaced:
            self._replaced = None
        if self._stopped_by is not None or member.leaves:
            return
        if member.serves:
            log.warning("worker %d (process %d) ended with %s", member.place, member.process.pid, code)
            return
        if not self._serving:
            for other in self._members:
                other.process.kill()
            sys.exit(code if code and code > 0 else FAULT)
        log.error("a new worker ended with %s before it served; the others stay as they are", code)
        self._outdated.clear()
        self._replaced = None
        self._retry_at = monotonic() + RETRY_S

    # --- what is done about it ---

    def _staying(self) -> list[Member]:
        return [member for member in self._members if not member.leaves]

    def _fill_up(self) -> None:
        """Start the workers that are missing, and one more where the next one is to be replaced."""
        if self._stopped_by is not None or (self._retry_at is not None and monotonic() < self._retry_at):
            return
        self._retry_at = None
        while self._replaced is None and self._outdated:
            oldest = self._outdated.pop(0)
            self._replaced = oldest if oldest in self._members else None
        staying = self._staying()
        wanted = self._settings.workers + (self._replaced in staying)
        if not any(member.serves for member in staying) and not self._serving:
            wanted = 1  # it shows whether the others can start
        for _ in range(wanted - len(staying)):
            self._start()

    def _start(self) -> None:
        taken = {member.place for member in self._members}
        place = next(place for place in range(self._board.places) if place not in taken)
        ready, tell = _FORK.Pipe(duplex=False)
        worker = Worker(self._settings, self._bound, self._board, place, tell, self._life)
        process = _FORK.Process(target=self._become, args=(worker,), name=f"fervor-worker-{place}")
        # A signal that came to the new process before its own handlers are there would count as one to this process.
        signal.pthread_sigmask(signal.SIG_BLOCK, _HEARD)
        process.start()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _HEARD)
        tell.close()
        self._members.append(Member(place, process, ready))

    def _become(self, worker: Worker) -> None:
        """In the new process: let go of what is the supervisor's."""
        signal.set_wakeup_fd(-1)
        os.close(self._hold)
        worker.work()


def with_key(settings: Settings) -> Settings:
    """Settings whose workers believe each other's checkpoints; a key is made up where there is none."""
    if settings.checkpoint_keys or settings.checkpoint_keys_file:
        return settings
    log.info("no FERVOR_CHECKPOINT_KEYS: streams survive the end of a worker, but not a restart of this service")
    return settings.model_copy(update={"checkpoint_keys": (SecretStr(secrets.token_hex(32)),)})


def send_away(member: Member) -> None:
    """Have a worker leave in good order."""
    member.leaves = True
    member.process.terminate()


@contextmanager
def heard_signals() -> Iterator[socket.socket]:
    """Signals as bytes on a socket, so that they can be waited for beside other things."""
    heard, told = socket.socketpair()
    with heard, told:
        told.setblocking(False)  # noqa: FBT003  # the standard library's
        before = {number: signal.signal(number, lambda *_: None) for number in _HEARD}
        signal.set_wakeup_fd(told.fileno())
        try:
            yield heard
        finally:
            signal.set_wakeup_fd(-1)
            for number, handler in before.items():
                signal.signal(number, handler)
