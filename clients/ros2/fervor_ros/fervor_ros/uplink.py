"""The line to the service: frames go up, estimates come down, in threads of their own.

Rules. Whoever has a frame never waits for the service: what can't leave yet is queued, and beyond `MOST_QUEUED` the
oldest frame is dropped and counted. The client mends cuts by itself and resumes; where there is no session yet, or it
is lost for good, another one is opened after a pause, on and on. `deliver` is called from a thread.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from fervor.errors import FervorError, FrameError
from fervor.protocol.messages import Estimate, ModelInfo
from fervor_client import Reconnect
from fervor_client.base import log_reconnect
from fervor_client.sync import Session
from fervor_ros.perception import Frame

logger = logging.getLogger("fervor_ros")

MOST_QUEUED = 1024
"""Frames: half a minute of one body at 30 Hz, beside those that the client has under way."""

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 10.0
"""Between attempts to open a session; doubled each time."""

END_S = 2.0
"""How long the goodbye may take."""


@dataclass(frozen=True, slots=True)
class Line:
    """How the line fares."""

    connected: bool = False
    model: ModelInfo | None = None
    trouble: str = ""
    """What went wrong last; empty once it is mended."""
    sessions: int = 0
    reconnects: int = 0
    sent: int = 0
    """Frames handed to the client."""
    answered: int = 0
    refused: int = 0
    dropped: int = 0


@dataclass(frozen=True, slots=True)
class _Gone:
    body: str


OpenSession = Callable[[Callable[[FervorError], None], Callable[[Reconnect], None]], Session]
"""Opens a session that tells of errors and of reconnects."""


class Uplink:
    """The line, from `start` to `close`."""

    def __init__(self, open_session: OpenSession, deliver: Callable[[Estimate], None]) -> None:
        self._open_session = open_session
        self._deliver = deliver
        self._news = threading.Condition()  # guards all that follows
        self._queue: deque[Frame | _Gone] = deque()
        self._queued = 0
        self._line = Line()
        self._session: Session | None = None
        self._closing = False
        self._here: set[str] = set()
        """Bodies of which frames went out in this session; the worker's own."""
        self._worker = threading.Thread(target=self._run, name="fervor-uplink", daemon=True)

    @property
    def line(self) -> Line:
        """How the line fares just now."""
        with self._news:
            return self._line

    def start(self) -> None:
        """Begin to look for the service."""
        self._worker.start()

    def send(self, frame: Frame) -> None:
        """Queue a frame."""
        with self._news:
            if self._queued >= MOST_QUEUED:
                self._queue.remove(next(item for item in self._queue if isinstance(item, Frame)))
                self._count(dropped=1)
            else:
                self._queued += 1
            self._queue.append(frame)
            self._news.notify_all()

    def end_body(self, body: str) -> None:
        """Queue that a body is gone."""
        with self._news:
            self._queue.append(_Gone(body))
            self._news.notify_all()

    def close(self) -> None:
        """Say goodbye, and end."""
        with self._news:
            self._closing = True
            session = self._session
            self._news.notify_all()
        if session is not None:
            self._part(session)
        self._worker.join(END_S)

    def _run(self) -> None:
        pause = FIRST_PAUSE_S
        while not self._is_closing():
            try:
                session = self._open_session(self._refused, self._reconnecting)
            except FervorError as error:
                self._note(error)
                self._wait(error.retry_after or pause)
                pause = min(2 * pause, LONGEST_PAUSE_S)
                continue
            pause = FIRST_PAUSE_S
            self._carry(session)

    def _carry(self, session: Session) -> None:
        """Send until the session is lost or all ends."""
        self._here.clear()
        with self._news:
            self._session = session
            self._line = replace(
                self._line, connected=True, model=session.model, trouble="", sessions=self._line.sessions + 1
            )
        reader = threading.Thread(target=self._read, args=(session,), name="fervor-downlink", daemon=True)
        reader.start()
        while (item := self._next(session)) is not None:
            try:
                self._pass_on(session, item)
            except FrameError as error:
                self._refused(error)
            except FervorError as error:
                self._note(error)
                break
        session.close()
        reader.join()
        with self._news:
            self._session = None
            self._line = replace(self._line, connected=False)

    def _pass_on(self, session: Session, item: Frame | _Gone) -> None:
        if isinstance(item, _Gone):
            if item.body in self._here:  # the service knows no others
                self._here.remove(item.body)
                session.end_body(item.body)
            return
        session.send(item.rotations, body=item.body, seq=item.seq, t=item.t, emotion=item.emotion)
        self._here.add(item.body)
        with self._news:
            self._count(sent=1)

    def _next(self, session: Session) -> Frame | _Gone | None:
        """What to send next; None: nothing more in this session."""
        with self._news:
            self._news.wait_for(lambda: self._queue or self._closing or self._session is not session)
            if self._closing or self._session is not session:
                return None
            item = self._queue.popleft()
            self._queued -= isinstance(item, Frame)
            return item

    def _read(self, session: Session) -> None:
        try:
            for estimate in session:
                with self._news:
                    self._count(answered=1)
                self._deliver(estimate)
        except FervorError as error:
            self._note(error)
        with self._news:
            if self._session is session:
                self._session = None
            self._news.notify_all()

    def _refused(self, error: FervorError) -> None:
        """A frame was refused, or another thing that the session survives."""
        logger.warning("%s", error.message)
        with self._news:
            self._count(refused=1)

    def _reconnecting(self, news: Reconnect) -> None:
        if news.attempt == 1 or news.delay_s is None:  # a long outage is told once
            log_reconnect(news)
        with self._news:
            if news.delay_s is not None:
                self._line = replace(self._line, connected=False, trouble=str(news.reason))
            else:
                self._line = replace(self._line, connected=True, trouble="", reconnects=self._line.reconnects + 1)

    def _note(self, error: FervorError) -> None:
        """Keep what went wrong, and tell it once."""
        with self._news:
            if self._closing:
                return
            told = self._line.trouble == error.message
            self._line = replace(self._line, connected=False, trouble=error.message)
        if not told:
            logger.warning("%s", error.message)

    def _count(self, **more: int) -> None:
        """Add to counters; the lock is held."""
        self._line = replace(self._line, **{name: getattr(self._line, name) + count for name, count in more.items()})

    def _wait(self, seconds: float) -> None:
        with self._news:
            self._news.wait_for(lambda: self._closing, seconds)

    def _is_closing(self) -> bool:
        with self._news:
            return self._closing

    def _part(self, session: Session) -> None:
        try:
            session.end(timeout=END_S)
        except (FervorError, TimeoutError) as error:
            logger.debug("the session did not end as it should: %s", error)
        session.close()
