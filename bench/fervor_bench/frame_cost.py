"""What a frame costs inside the service, without the wire: by stage, and how that grows with bodies and joints.

Absolute times drift with the machine; the ratios, taken in turn within one run, are what to compare.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import starmap

import numpy as np
import numpy.typing as npt
from rich.table import Table

from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.model import Floats, Model, Outputs, default_model_path
from fervor.protocol.codec import CODECS, Codec
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import Limits, ModelInfo, SessionStart
from fervor.session.events import Outcome, Reply, Said, Ticket
from fervor.session.host import Host
from fervor.session.poses import Read, read_poses
from fervor.session.session import Session
from fervor.skeletons.adapter import adapt
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor_bench.machine import pinned
from fervor_bench.traffic import Encoding, Traffic

CROWDS: tuple[tuple[Encoding, int], ...] = (
    ("msgpack", 1),
    ("msgpack", 8),
    ("msgpack", 64),
    ("msgpack", 256),
    ("json", 64),
)
"""Encoding, and bodies that send together."""

AHEAD = 130
"""Frames before any is measured: then a body has both of its states."""

FRAMES, ROUNDS = 60, 5
"""Of each crowd; the best round of each stage counts, the one that the machine disturbed least."""

Conclude = Callable[[Sequence[Ticket], Sequence[Outcome | EngineError]], Sequence[Said]]
"""From the outcomes of tickets to what is said of them."""

STAGES = ("decode", "plan", "engine", "model", "conclude", "encode")


@dataclass(frozen=True, slots=True)
class Inside:
    """Where a frame's time goes between the sockets."""

    encoding: Encoding
    bodies: int
    """That send together, each in a session of its own."""
    stages_us: Mapping[str, float]
    """Of `STAGES`, a frame; `engine` without the model."""

    @property
    def frame_us(self) -> float:
        """All stages."""
        return sum(self.stages_us.values())


def adapting_costs() -> Table:
    """Measure what skeletons cost, and show it."""
    return _adapting(Model.load(default_model_path()))


def measure_inside(processor: int | None = None) -> Sequence[Inside]:
    """Measure all crowds, on one processor if it is given."""
    with nullcontext() if processor is None else pinned(processor):
        return list(starmap(_measure, CROWDS))


def _measure(encoding: Encoding, bodies: int) -> Inside:
    crowd = _Crowd(encoding, bodies, AHEAD + ROUNDS * FRAMES)
    for _ in range(AHEAD):
        crowd.step()
    best = dict.fromkeys(STAGES, float("inf"))
    for _ in range(ROUNDS):
        crowd.watch.spent.clear()
        for _ in range(FRAMES):
            crowd.step()
        for stage in STAGES:
            best[stage] = min(best[stage], crowd.watch.spent[stage])
    return Inside(encoding, bodies, {stage: 1e6 * spent / (FRAMES * bodies) for stage, spent in best.items()})


class _Watch:
    """Seconds by stage; a stage within another is not the other's."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}
        self._inner = 0.0

    @contextmanager
    def on(self, stage: str) -> Iterator[None]:
        outer, self._inner = self._inner, 0.0
        begin = time.perf_counter()
        yield
        taken = time.perf_counter() - begin
        self.spent[stage] = self.spent.get(stage, 0.0) + taken - self._inner
        self._inner = outer + taken


class _Model(Model):
    """The model, watched."""

    watch = _Watch()  # while it is loaded

    def run(self, rotations: Floats, mask: Floats, emotion: Floats, states: Mapping[str, Floats]) -> Outputs:
        with self.watch.on("model"):
            return super().run(rotations, mask, emotion, states)


class _Crowd:
    """Sessions of a body each whose messages are taken together, as in one turn of the service's loop."""

    def __init__(self, encoding: Encoding, bodies: int, frames: int) -> None:
        model = _Model.load(default_model_path())
        assert isinstance(model, _Model)
        self.watch = model.watch = _Watch()
        traffic = Traffic(encoding=encoding, checkpoints=False)
        self._text = encoding == "json"
        self._codec: Codec = CODECS[traffic.subprotocol]
        self._engine = Engine(model, capacity=bodies)
        host = _host(model, self._engine)
        self._sessions = [Session(str(number), host) for number in range(bodies)]
        for session in self._sessions:
            session.receive(SessionStart.model_validate(traffic.start()))
        self._agreements = [session.agreement for session in self._sessions if session.agreement is not None]
        variants = min(bodies, 16)
        scripts = [list(traffic.payloads(variant, frames)) for variant in range(variants)]
        self._payloads = [list(payloads) for payloads in zip(*scripts, strict=True)]  # [frame][variant]
        self._frame = 0

    def step(self) -> None:
        """One frame of every session, from its bytes to those of its answer."""
        payloads = self._payloads[self._frame]
        self._frame += 1
        data = [payloads[place % len(payloads)] for place in range(len(self._sessions))]
        came = [each.decode() for each in data] if self._text else data
        decode, encode = self._codec.decode_frames, self._codec.encode
        with self.watch.on("decode"):
            frames = [_frame(decode(each)) for each in came]
            poses = read_poses(list(zip(self._agreements, frames, strict=True)))
        with self.watch.on("plan"):
            planned = [_plan(*each) for each in zip(self._sessions, frames, poses, strict=True)]
        with self.watch.on("engine"):
            outcomes = self._engine.run([ticket for ticket, _ in planned])
        with self.watch.on("conclude"):
            replies = [
                said
                for (ticket, conclude), outcome in zip(planned, outcomes, strict=True)
                for said in conclude([ticket], [outcome])
            ]
        with self.watch.on("encode"):
            answers = [encode(reply) for reply in replies]
        assert len(answers) == len(self._sessions)


def _plan(session: Session, frame: LeanFrame, pose: Read) -> tuple[Ticket, Conclude]:
    """A frame's ticket, and who takes its outcome: at once where nothing is unusual, as in a turn of the service."""
    prompt = session.prompt(frame, [pose])
    if prompt:
        return prompt[0], session.answer
    (ticket,) = (event for event in session.receive(frame, [pose]) if isinstance(event, Ticket))

    def conclude(tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> list[Said]:
        events = session.conclude(tickets[0], outcomes[0])
        return [event.message for event in events if isinstance(event, Reply)]

    return ticket, conclude


def _frame(message: LeanFrame | LeanFrames | None) -> LeanFrame:
    assert isinstance(message, LeanFrame)
    return message


def _host(model: Model, engine: Engine) -> Host:
    """A service without a wire."""
    metadata = model.metadata
    info = ModelInfo(
        name=metadata.name,
        version=metadata.version,
        purpose=metadata.purpose,
        sha256=model.sha256,
        rate_hz=metadata.rate_hz,
        emotions=metadata.emotions,
        thresholds=metadata.levels.threshold,
    )
    return Host(info, metadata, Limits(), model.fingerprint, engine.claim)


def _adapting(model: Model) -> Table:
    step = _best(partial(_steps, model, 256)) / FRAMES
    table = Table(title="adapting 256 frames, against one model step for them")
    for heading in ("skeleton", "joints", "µs", "of a step"):
        table.add_column(heading, justify="right")
    for name in SKELETONS:
        known = skeleton(name)
        rotations = _motion(256, len(known.joints))
        observed = np.ones(rotations.shape[:2], np.bool_)
        cost = _best(partial(adapt, known, rotations, observed, axes=known.axes))
        table.add_row(name, f"{len(known.joints)}", f"{cost * 1e6:.0f}", f"{cost / step:.0%}")
    return table


def _steps(model: Model, bodies: int) -> None:
    rotations = np.tile(_motion(1, 13)[:, None].astype(np.float32), (bodies, 1, 1, 1))
    mask, emotion = np.ones((bodies, 1, 13), np.float32), np.zeros((bodies, 1, 11), np.float32)
    states = model.zero_states(bodies)
    for _ in range(FRAMES):
        states = model.run(rotations, mask, emotion, states).states


def _motion(frames: int, joints: int) -> npt.NDArray[np.float64]:
    walk = np.random.default_rng(0).standard_normal((frames, joints, 4)) * 0.2 + np.array([0.0, 0.0, 0.0, 1.0])
    unit: npt.NDArray[np.float64] = walk / np.linalg.norm(walk, axis=-1, keepdims=True)
    return unit


def _best(work: Callable[[], object]) -> float:
    """Shortest of a few runs, seconds: the one the machine disturbed least."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)
