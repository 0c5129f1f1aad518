"""Any conversation, cut at any message: what a client of the documents gets is what it would have got uninterrupted.

One real session with a real engine hears everything and is never cut. The client talks to another one, whose engine
lags behind, which is replaced at every cut, and whose last words are lost then. The client keeps what
docs/reference/protocol.md tells it to keep ("Going on"), and nothing else.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import event as note
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from bodies import as_read, host, model, motion
from fervor.engine.engine import Engine
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Checkpoint,
    Error,
    Estimate,
    Estimates,
    Frame,
    Frames,
    SessionCalibrate,
    SessionCalibrated,
    SessionStart,
    SessionStarted,
)
from fervor.session.events import Close, Release, Reply, Restore, Ticket
from fervor.session.sealing import Sealer
from fervor.session.session import Session

SEALER = Sealer((b"key",), 300.0)
POSES = [tuple(map(tuple, pose.tolist())) for pose in motion(997, joints=25)]
HELD = POSES[0]
BODIES = ("ann", "bob", "cyd")
LABELS = (None, None, None, "joy", "fear", {"fear": 0.6, "joy": 0.3}, "unknown")

Key = tuple[str, int, int]  # body, which of its lives, seq


class Replica:
    """A service with the common key and one session on it; its engine works when told to."""

    def __init__(self) -> None:
        self.engine = Engine(model(), capacity=4)
        base = host(self.engine.claim, max_bodies=3)
        seal, unseal = lambda content: SEALER.seal(content, 0.0), lambda token: SEALER.open(token, 1.0)
        self.session = Session("s", replace(base, seal=seal, unseal=unseal))
        self.said: deque = deque()
        self.work: deque[Ticket] = deque()

    def hear(self, message) -> None:
        self._carry(self.session.receive(message))

    def toil(self, most: int = 1_000_000) -> None:
        """Up to `most` tickets, in batches as large as can be: of each slot one, as the engine wants it."""
        while self.work and most > 0:
            batch: dict[int, Ticket] = {}
            while self.work and self.work[0].slot not in batch and len(batch) < most:
                ticket = self.work.popleft()
                batch[ticket.slot] = ticket
            most -= len(batch)
            for ticket, outcome in zip(batch.values(), self.engine.run(list(batch.values())), strict=True):
                self._carry(self.session.conclude(ticket, outcome))

    def drain(self) -> None:
        self._carry(self.session.checkpoints())
        self.toil()

    def _carry(self, events) -> None:
        for event in events:
            match event:
                case Reply(message):
                    self.said.append(as_read(message))
                case Ticket():
                    self.work.append(event)
                case Restore(slot, memory):
                    self.engine.restore(slot, memory)
                case Release(slot):
                    self.toil()  # after all earlier tickets
                    self.engine.release(slot)
                case Close(code, reason):
                    raise AssertionError(f"the service closed: {code} {reason}")


@dataclass(eq=False)
class Entry:
    """A message that may have to be sent again."""

    message: Frame | BodyReset | BodyEnd | SessionCalibrate
    repeats: bool = False
    answered: bool = False

    @property
    def body(self) -> str:
        return self.message.body

    @property
    def seq(self) -> int | None:
        return self.message.seq if isinstance(self.message, Frame) else None


@dataclass
class Kept:
    """What the client keeps of a body, beside its entries in the log."""

    token: str | None = None
    covers: int = -1
    life: int = 0  # of the newest frame sent
    here: bool = False
    newest: int = -1
    last: float = -np.inf


class Client:
    """Written from the documents."""

    def __init__(self, start: SessionStart) -> None:
        self.start = start
        self.bodies = {name: Kept() for name in BODIES}
        self.log: list[Entry] = []
        self.answers: dict[Key, list[Estimate]] = {}
        self.refused: set[Key] = set()
        self.asked: list[Key] = []
        self._lives: dict[tuple[str, int], int] = {}  # of a frame, by body and seq: seqs are not used twice

    def opening(self) -> SessionStart:
        return self.start.model_copy(update={"resume": tuple(k.token for k in self.bodies.values() if k.token)})

    def key(self, body: str, seq: int) -> Key:
        return body, self._lives[body, seq], seq

    def sends(self, message) -> None:
        for part in message.frames if isinstance(message, Frames) else [message]:
            repeats = isinstance(part, Frame) and (part.body, part.seq) in self._lives
            if isinstance(part, Frame):
                self._appears(part)
                self._lives.setdefault((part.body, part.seq), self.bodies[part.body].life)
                self.asked.append(self.key(part.body, part.seq))
            self.log.append(Entry(part, repeats))
            if isinstance(part, BodyEnd):
                self._gone(part.body)

    def hears(self, message) -> None:
        match message:
            case Estimate():
                self._answered(message)
            case Estimates():
                for estimate in message.estimates:
                    self._answered(estimate)
            case Checkpoint():
                self._covered(message)
            case SessionCalibrated():
                self._calibrated(message)
            case Error(seq=int()):
                self.refused.add(self.key(message.body, message.seq))
                self._drop(lambda entry: (entry.body, entry.seq) == (message.body, message.seq))
            case Error(code="bad_input"):
                self._drop(lambda entry: isinstance(entry.message, SessionCalibrate))
                self._bury_all()

    def _calibrated(self, message: SessionCalibrated) -> None:
        self.start = self.start.model_copy(update={"skeleton": message.skeleton})
        if not self._skips:
            waiting = (place for place, entry in enumerate(self.log) if entry.seq is not None and not entry.answered)
            until = next(waiting, len(self.log))
            done = max((place for place, entry in enumerate(self.log[:until]) if entry.answered), default=-1)
            del self.log[: done + 1]
        self._drop(lambda entry: isinstance(entry.message, SessionCalibrate))
        for kept in self.bodies.values():
            kept.token = None
        self._bury_all()
        for each in message.checkpoints:
            self._covered(each)

    def _bury_all(self) -> None:
        for name in BODIES:
            self._bury(name)

    def _appears(self, frame: Frame) -> None:
        """Where a body comes, or comes back, the service forgets those that are idle."""
        kept, idle = self.bodies[frame.body], self.start.clock == "time"
        back = kept.here and idle and frame.t - kept.last > 10.0
        if back or not kept.here:
            kept.newest = -1 if back else kept.newest
            for name, other in self.bodies.items():
                if name != frame.body and other.here and idle and frame.t - other.last > 10.0:
                    self.log.append(Entry(BodyEnd(body=name)))
                    self._gone(name)
        kept.here = True
        if frame.seq > kept.newest and not 0.0 <= kept.last - frame.t <= 1.0:
            kept.last = frame.t
        kept.newest = max(kept.newest, frame.seq)

    def _gone(self, body: str) -> None:
        kept = self.bodies[body]
        kept.life, kept.here, kept.newest, kept.last = kept.life + 1, False, -1, -np.inf
        self._bury(body)

    def _answered(self, estimate: Estimate) -> None:
        self.answers.setdefault(self.key(estimate.body, estimate.seq), []).append(estimate)
        for entry in self.log:
            if entry.body == estimate.body and entry.seq is not None and entry.seq <= estimate.seq:
                entry.answered = entry.answered or entry.seq == estimate.seq or self._skips
        self._bury(estimate.body)

    def _bury(self, body: str) -> None:
        """Of lives that ended, whose frames are all answered, nothing is kept; unless a calibration rests on it."""
        if any(isinstance(entry.message, SessionCalibrate) and entry.body == body for entry in self.log):
            return
        mine = [entry for entry in self.log if entry.body == body and not isinstance(entry.message, SessionCalibrate)]
        for place, entry in enumerate(mine):
            if entry.seq is not None and not entry.answered:
                return
            if isinstance(entry.message, BodyEnd):
                gone = mine[: place + 1]
                self._drop(lambda entry: entry in gone)  # noqa: B023
                self.bodies[body].token, self.bodies[body].covers = None, -1

    def _covered(self, message: Checkpoint) -> None:
        kept = self.bodies[message.body]
        if self._lives[message.body, message.seq] != kept.life:
            return  # of a life that is over
        if message.seq != kept.covers or not kept.token:
            mine = [entry for entry in self.log if entry.body == message.body]
            mine = [entry for entry in mine if not isinstance(entry.message, SessionCalibrate)]
            named = (at for at, entry in enumerate(mine) if entry.seq == message.seq and not entry.repeats)
            place = next(named, -1)  # a frame that was sent again is not the one that a checkpoint names
            covered = mine[: place + 1]
            assert all(entry.answered or entry.seq is None or self._skips for entry in covered), "answers come first"
            self._drop(lambda entry: entry in covered)
        kept.token, kept.covers = message.token, message.seq

    @property
    def _skips(self) -> bool:
        return self.start.delivery == "latest"

    def _drop(self, which) -> None:
        self.log = [entry for entry in self.log if not which(entry)]


class Interrupted(RuleBasedStateMachine):
    """What people do, what the machine does, and cuts."""

    @initialize(
        clock=st.sampled_from(["time", "frames"]),
        memory=st.sampled_from(["staggered", "stateful", "window"]),
        delivery=st.sampled_from(["every", "latest"]),
        checkpoint_s=st.sampled_from([0.1, 0.5, 3.0]),
        by_emotion=st.booleans(),
    )
    def begin(self, clock, memory, delivery, checkpoint_s, by_emotion):
        start = SessionStart(
            skeleton="kinect_v2",
            axes="local",
            clock=clock,
            memory=memory,
            checkpoint_s=checkpoint_s,
            by_emotion=by_emotion,
            emotion="joy",
            delivery=delivery,
        )
        self.client, self.reference = Client(start), Client(start.model_copy(update={"delivery": "every"}))
        self.whole, self.service = Replica(), Replica()
        self.whole.hear(self.reference.start)
        self.service.hear(self.client.opening())
        self.time, self.count = 100.0, 1000
        self.still: set[str] = set()

    # --- what people do ---

    @rule(
        body=st.sampled_from(BODIES),
        frames=st.integers(1, 25),
        pace=st.sampled_from([0.01, 1 / 30, 1 / 30, 0.05]),
        pause=st.sampled_from([0.0, 0.0, 0.3, 0.7, 1.4, 11.0]),
        label=st.sampled_from(LABELS),
        lost=st.sampled_from([(), (), (1, 5), tuple(range(25))]),
        parcel=st.booleans(),
    )
    def move(self, *, body, frames, pace, pause, label, lost, parcel):
        self.time += pause
        sent = []
        for number in range(frames):
            self.time += pace
            sent.append(self._frame(body, self._number(), label if number == 0 else None, lost))
        if parcel:
            self._say(Frames(frames=tuple(sent)))
        else:
            for frame in sent:
                self._say(frame)

    @rule(frames=st.lists(st.sampled_from(BODIES), min_size=2, max_size=9))
    def move_together(self, frames):
        sent = []
        for body in frames:
            self.time += 0.012
            sent.append(self._frame(body, self._number()))
        self._say(Frames(frames=tuple(sent)))

    @precondition(lambda self: self.reference.asked)
    @rule(back=st.integers(1, 80), label=st.sampled_from(LABELS))
    def repeat(self, back, label):
        body, life, seq = self.reference.asked[-min(back, len(self.reference.asked))]
        refused = (body, life, seq) in self.reference.refused
        if life == self.reference.bodies[body].life and self.reference.bodies[body].here and not refused:
            self._say(self._frame(body, seq, label))

    @precondition(lambda self: self.reference.asked)
    @rule(what=st.sampled_from(["late", "early clock", "far from unit", "no such emotion"]))
    def go_wrong(self, what):
        body, life, seq = self.reference.asked[-1]
        if life != self.reference.bodies[body].life or not self.reference.bodies[body].here:
            return
        if what == "late":
            if (body, seq - 3) not in self.reference._lives:
                self._say(self._frame(body, seq - 3, "fear"))
        elif what == "early clock":
            self._say(self._frame(body, self._number(), back=3.0))
        elif what == "far from unit":
            frame = self._frame(body, self._number())
            self._say(frame.model_copy(update={"q": ((9.0, 0.0, 0.0, 0.0), *frame.q[1:])}))
        else:
            self._say(self._frame(body, self._number(), "ennui"))

    @rule(body=st.sampled_from(BODIES), what=st.sampled_from([BodyReset, BodyReset, BodyEnd]))
    def leave(self, body, what):
        if self.reference.bodies[body].here:
            self._say(what(body=body))

    @rule(body=st.sampled_from(BODIES))
    def hold_still(self, body):
        for client in (self.client, self.reference):
            if any(isinstance(entry.message, SessionCalibrate) for entry in client.log):
                return  # one at a time
        self.still.add(body)
        self._say(SessionCalibrate(body=body, seconds=0.4))

    # --- what the machine does ---

    @rule(tickets=st.integers(1, 60))
    def work(self, tickets):
        self.service.toil(tickets)

    @rule(messages=st.integers(1, 60))
    def listen(self, messages):
        self._listen(messages)

    @rule(drained=st.booleans(), heard=st.integers(0, 80))
    def cut(self, drained, heard):
        if drained:
            self.service.drain()
        self._listen(heard)
        self.service = Replica()
        start = self.client.opening()
        self.service.hear(start)
        started = self.service.said.popleft()
        assert isinstance(started, SessionStarted), started
        note(f"cut with {len(start.resume)} checkpoints")
        assert len(started.resumed) == len(start.resume)
        assert all(resumed.same_runtime for resumed in started.resumed)
        for entry in list(self.client.log):
            self.service.hear(entry.message)

    def teardown(self):
        if not hasattr(self, "service"):
            return
        self.service.toil()
        self._listen(1_000_000)
        assert self.client.refused == self.reference.refused
        assert set(self.client.answers) <= set(self.reference.answers)
        if self.client.start.delivery == "every":
            assert set(self.client.answers) == set(self.reference.answers), "none is missing"
            assert set(self.reference.answers) | self.reference.refused == set(self.reference.asked)

    # --- how ---

    def _number(self) -> int:
        self.count += 10
        return self.count

    def _frame(self, body, seq, label=None, lost=(), back=0.0) -> Frame:
        pose = HELD if body in self.still else POSES[seq % len(POSES)]
        q = tuple(None if joint in lost else turn for joint, turn in enumerate(pose))
        self.time -= back
        return Frame(body=body, seq=seq, t=self.time, q=q, emotion=label)

    def _say(self, message) -> None:
        self.reference.sends(message)
        self.whole.hear(message)
        self.whole.toil()
        while self.whole.said:
            self._heard(self.reference, self.whole.said.popleft())
        self.client.sends(message)
        self.service.hear(message)

    def _heard(self, client, message) -> None:
        client.hears(message)
        if isinstance(message, SessionCalibrated):
            note("calibrated")
            self.still.clear()

    def _listen(self, most: int) -> None:
        while self.service.said and most > 0:
            message = self.service.said.popleft()
            self.client.hears(message)
            for estimate in (message,) if isinstance(message, Estimate) else getattr(message, "estimates", ()):
                self._compare(self.client.key(estimate.body, estimate.seq), estimate)
            most -= 1

    def _compare(self, key: Key, estimate: Estimate) -> None:
        expected = self.reference.answers[key]
        if self.client.start.delivery == "latest":  # any of its answers may be the first that comes, or the only one
            assert bare(estimate) in map(bare, expected), f"{estimate} is none of {expected}"
            return
        first, *again = self.client.answers[key]
        if first.flags[-1:] == ("duplicate",) and expected[0].flags[-1:] != ("duplicate",):
            first = bare(first)  # a repeated answer may overtake
        assert first == expected[0], f"{first} is not {expected[0]}"
        for other in again[-1:]:
            flags = tuple(flag for flag in other.flags if flag not in ("duplicate", "late"))
            own = tuple(flag for flag in expected[0].flags if flag not in ("duplicate", "late"))
            if "late" not in other.flags:
                same = expected[0].model_copy(update={"flags": own})
                assert other.model_copy(update={"flags": flags}) == same, other


def bare(estimate: Estimate) -> Estimate:
    """An answer without the note that it is not the first to its frame."""
    return estimate.model_copy(update={"flags": tuple(flag for flag in estimate.flags if flag != "duplicate")})


@pytest.mark.timeout(600)
@pytest.mark.parametrize("examples", [8, pytest.param(120, marks=pytest.mark.slow)])
def test_any_conversation_cut_anywhere(examples):
    """The same conversations in every run, so that a failure in CI is one that can be repeated."""
    run_state_machine_as_test(
        Interrupted,
        settings=settings(max_examples=examples, stateful_step_count=30, deadline=None, derandomize=True),
    )
