"""The bridge: poses go to the service, estimates to the behaviour core, acts to the robot, all of it into the log.

    with sync.connect(url, skeleton="kinect_v2") as session, Companion(robot, session) as companion:
        while True:
            companion.feed(read_pose(), emotion=read_face())

Three threads: one reads estimates, one has the robot act, and one owns the performer and takes their news in turn. The
robot's faults end no stream, and the service's end no show: fillers go on.
"""

import logging
import queue
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from fervor.errors import FervorError
from fervor.protocol.messages import Estimate
from fervor_client.poses import Pose
from fervor_client.sync import Session
from fervor_pepper.acts import Act, Command
from fervor_pepper.behaviour import Behaviour, Mode
from fervor_pepper.behaviour_file import default_behaviour
from fervor_pepper.performer import STOP_S, Performer
from fervor_pepper.phase import Phase
from fervor_pepper.robot import Robot
from fervor_pepper.session_log import SessionLog
from fervor_pepper.stage import Outcome, Stage

logger = logging.getLogger("fervor_pepper")

TICK_S = 0.1
"""Fillers, pauses and timeouts are kept to about this."""


@dataclass(frozen=True, slots=True)
class _Left:
    body: str


@dataclass(frozen=True, slots=True)
class _Lost:
    error: FervorError


@dataclass(frozen=True, slots=True)
class _Close:
    at_once: bool


_News = Estimate | Outcome | _Left | _Lost | _Close


class Companion:
    """A robot that answers to the people whose poses it is fed. Use it in a `with`, inside that of its session."""

    def __init__(
        self,
        robot: Robot,
        session: Session,
        *,
        mode: Mode = "expressive",
        behaviour: Behaviour | None = None,
        seed: int | None = None,
        log: SessionLog | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """Args:
        robot: who acts.
        session: with the service; its estimates are read here, and by nobody else.
        mode: `none` or `expressive`.
        behaviour: what to say and do; the packaged one if None.
        seed: of what is chosen at random.
        log: where to record the session.
        now: seconds, never falling.
        """  # noqa: D205
        self._behaviour = behaviour or default_behaviour()
        self._session = session
        self._performer = Performer(self._behaviour, mode, seed=seed)
        self._log = log
        self._now = now
        self._news: queue.SimpleQueue[_News] = queue.SimpleQueue()
        self._stage = Stage(robot, self._news.put)
        self._told: set[str] = set()
        self._closing = False
        self._reader = threading.Thread(target=self._read, name="fervor-pepper-reader", daemon=True)
        self._mind = threading.Thread(target=self._run, name="fervor-pepper", daemon=True)

    def feed(
        self,
        pose: Pose,
        emotion: str | Mapping[str, float] | None = None,
        *,
        body: str = "0",
        t: float | None = None,
        mask: Sequence[bool] | None = None,
    ) -> None:
        """Send a pose; the robot answers when it is time. See `fervor_client.sync.Session.send`.

        Args:
            pose: [joint, 4] quaternions in the order of the session's joints; None or NaN where untracked.
            emotion: what the face analyser says, a label or a probability per emotion; the old one holds if None.
            body: whose pose it is.
            t: seconds on the sensor's clock; the monotonic clock's now if None.
            mask: [joint], false where untracked.

        Raises:
            FrameError: the pose can't be sent; the session goes on.
            FervorError: the session is lost or has ended.
        """
        self._session.send(pose, body=body, t=t, emotion=emotion, mask=mask)

    def leave(self, body: str) -> None:
        """Say that a person is gone; else they are missed after a while."""
        self._session.end_body(body)
        self._news.put(_Left(body))

    def __enter__(self) -> Self:
        """Begin."""
        if self._log is not None:
            model = self._session.model
            self._log.begin(
                f"mode {self._performer.mode}; language {self._behaviour.language}; "
                f"model {model.name} {model.version} ({model.purpose})"
            )
        self._stage.open()
        for thread in (self._reader, self._mind):
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the session, let the robot finish what it does, and close the log; after an error, stop it at once."""
        timeout = self._behaviour.timing.act_timeout_s + 2 * STOP_S
        if kind is None:
            self._end_session()
        else:
            self._session.close()
        self._reader.join(timeout)
        self._news.put(_Close(at_once=kind is not None))
        self._mind.join(timeout)
        self._stage.close(STOP_S)
        if self._log is not None:
            self._log.end()

    def _end_session(self) -> None:
        try:
            self._session.end()
        except (FervorError, TimeoutError) as error:
            logger.warning("the session did not end as it should: %s", error)
            self._session.close()

    def _read(self) -> None:
        try:
            for estimate in self._session:
                self._news.put(estimate)
        except FervorError as error:
            self._news.put(_Lost(error))

    def _run(self) -> None:
        while not (self._closing and self._performer.phase in (Phase.IDLE, Phase.RESTING)):
            try:
                news = self._news.get(timeout=TICK_S)
            except queue.Empty:
                news = None
            self._obey(self._take(news))

    def _take(self, news: _News | None) -> Iterable[Command]:
        now, performer = self._now(), self._performer
        self._record(news)
        match news:
            case Estimate():
                return performer.perceive(news, now)
            case Outcome(error=None):
                return performer.ended(news.act.number, now)
            case Outcome():
                return performer.failed(news.act.number, now, reached=news.reached)
            case _Left():
                performer.leave(news.body)
            case _Close():
                self._closing = True
                if news.at_once:
                    self._stage.stop()
        return performer.tick(now)

    def _obey(self, commands: Iterable[Command]) -> None:
        for command in commands:
            if not isinstance(command, Act):
                self._stage.stop()
            elif self._closing:
                self._performer.failed(command.number, self._now())
            else:
                if self._log is not None:
                    self._log.act(command)
                self._stage.start(command)

    def _record(self, news: _News | None) -> None:
        """Log it, and tell what went wrong."""
        match news, self._log:
            case Estimate() as estimate, SessionLog() as log:
                log.estimate(estimate)
            case Outcome() as outcome, log:
                self._complain(outcome)
                if log is not None:
                    log.outcome(outcome)
            case _Left(body), SessionLog() as log:
                log.left(body)
            case _Lost(error), log:
                logger.warning("no more estimates come: %s", error)
                if log is not None:
                    log.lost(error.message)

    def _complain(self, outcome: Outcome) -> None:
        """Tell a robot's complaint once; that it is out of reach is told by the robot itself."""
        if outcome.error is not None and outcome.reached and outcome.error.message not in self._told:
            self._told.add(outcome.error.message)
            logger.warning("%s", outcome.error)
