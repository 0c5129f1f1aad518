"""What a frame costs inside the service, without the wire, and how that grows with bodies and joints.

Absolute times drift with the machine; the ratios, taken in turn within one run, are what to compare.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt
from rich.table import Table

from fervor.engine.engine import Engine
from fervor.model import Model, default_model_path
from fervor.session.body import Body, Terms
from fervor.session.events import Pose, Source
from fervor.skeletons.adapter import adapt
from fervor.skeletons.catalog import SKELETONS, skeleton

BATCHES = (1, 16, 64, 256)
FRAMES = 120
ROUNDS = 5


def frame_costs() -> list[Table]:
    """Measure, and show as tables: batching, joints."""
    model = Model.load(default_model_path())
    return [_batching(model), _adapting(model)]


def _batching(model: Model) -> Table:
    table = Table(title="a 30 Hz frame, from session to estimate, one core")
    for heading in ("bodies together", "µs a frame", "gain over one", "model alone, µs", "share of model"):
        table.add_column(heading, justify="right")
    alone = None
    for bodies in BATCHES:
        whole = _best(partial(_stream, model, bodies)) / (bodies * FRAMES) * 1e6
        step = _best(partial(_steps, model, bodies)) / (bodies * FRAMES) * 1e6
        alone = alone or whole
        table.add_row(f"{bodies}", f"{whole:.1f}", f"x {alone / whole:.1f}", f"{step:.1f}", f"{step / whole:.0%}")
    return table


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


def _stream(model: Model, bodies: int) -> None:
    known = skeleton("c13")
    terms = Terms(model.metadata, Source(known, known.axes))
    engine = Engine(model, capacity=bodies)
    crowd = [Body(str(number), engine.claim(), terms) for number in range(bodies)]
    poses = [Pose(rotations, np.ones(13, np.bool_)) for rotations in _motion(FRAMES, 13)]
    for seq, pose in enumerate(poses):
        tickets = [body.plan(seq, seq / 30.0, pose) for body in crowd]
        for body, ticket, outcome in zip(crowd, tickets, engine.run(tickets), strict=True):
            body.conclude(ticket, outcome)  # type: ignore[arg-type]  # the packaged model does not fail


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
