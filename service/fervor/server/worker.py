"""One of several processes that serve one address. The supervisor forks it; what it does there is `Worker.work`.

Rules. It takes connections from the listening socket that all share, unless it has more than another. It leaves as a
service does that runs alone, with last checkpoints and 1012, and while the others stay it stops taking connections
first. It does not outlive the supervisor. Ctrl-C and SIGHUP, which a terminal sends to all of its processes, are the
supervisor's to hear.
"""

import gc
import os
import signal
import socket
import sys
import threading
from dataclasses import dataclass
from multiprocessing.connection import Connection

from fervor.errors import FervorError
from fervor.server.board import Board
from fervor.server.run import Server, configure, end_well, leave_alone_what_is_loaded
from fervor.settings import Settings


@dataclass(frozen=True, slots=True)
class Worker:
    """What a worker is given."""

    settings: Settings
    bound: socket.socket
    board: Board
    place: int
    ready: Connection
    """Told once, when it serves."""
    life: int
    """A pipe that ends with the supervisor."""

    def work(self) -> None:
        """Serve until told to stop."""
        told = end_well()
        signal.pthread_sigmask(signal.SIG_SETMASK, {signal.SIGINT, signal.SIGHUP})
        threading.Thread(target=self._end_with_supervisor, daemon=True).start()
        gc.disable()  # until all is loaded
        try:
            config = configure(self.settings)
            config.app.state.service.metrics.gather(self.board, self.place)  # type: ignore[union-attr]
            leave_alone_what_is_loaded()
            Server(
                config,
                on_listening=lambda _: self.ready.send("serves"),
                board=self.board,
                place=self.place,
                told=told,
            ).run(sockets=[self.bound])
        except FervorError as error:
            sys.stderr.write(f"fervor: {error.message}\n")
            sys.exit(error.exit_code)

    def _end_with_supervisor(self) -> None:
        os.read(self.life, 1)
        os.kill(os.getpid(), signal.SIGTERM)
