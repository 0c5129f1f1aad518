"""Whether a model file computes what its network does: torch against onnxruntime, where rotations are hardest."""

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from fervor.emotions import EMOTIONS
from fervor.metadata import INTENSITY, INTENSITY_BY_EMOTION, NEXT
from fervor.model import Model
from fervor.skeletons.rig import JOINTS
from fervor_export.network import Network

TOLERANCE = 1e-5
"""Largest difference allowed in any output, relative for cell states beyond 1; measured ones are about 1e-7."""

ROUNDING = 8.0
"""How many times as far as torch's own rounding took it a result may be, where that is more than `TOLERANCE` allows:
a trained network that is fed nonsense can be so steep that float32 has no better answer."""

MOST = 1e-3
"""What no rounding excuses: at half turns, say, float64 may take another branch than float32, but both of these must
take the same."""

Frames = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.float32]]
"""Rotations [batch, time, 13, 4], mask [batch, time, 13], emotion [batch, time, 11]."""


@dataclass(frozen=True, slots=True)
class ParityReport:
    """The difference that comes nearest to what is allowed, or exceeds it most."""

    largest: float
    allowed: float
    """There: `TOLERANCE`, or more where torch itself is further from the result in float64."""
    where: str
    """Case and output, "edges: intensity" say."""
    cases: int

    @property
    def agrees(self) -> bool:
        """Whether the difference is allowed; a NaN is not."""
        return self.largest <= self.allowed


def check_parity(network: Network, model: Model, *, seed: int = 0) -> ParityReport:
    """Compare every output of a network and its model file, over cases chosen to find differences.

    Random turns, long sequences and large batches, small steps, gimbal lock, half turns, flipped hemispheres, lost
    joints and zero quaternions, mixed and unknown emotions; twice each, the second time with the states of the first.
    """
    was_training = network.training
    exact = copy.deepcopy(network.eval()).double()
    try:
        found = [
            _Difference(case, *difference)
            for case, frames in _cases(np.random.default_rng(seed))
            for difference in _differences(network, exact, model, frames)
        ]
    finally:
        network.train(was_training)
    worst = max(found, key=lambda entry: np.inf if np.isnan(entry.size) else entry.size / entry.allowed)
    return ParityReport(
        worst.size, worst.allowed, f"{worst.case}: {worst.output}", len({entry.case for entry in found})
    )


@dataclass(frozen=True, slots=True)
class _Difference:
    """Of one output, over one case."""

    case: str
    output: str
    size: float
    allowed: float


def _differences(network: Network, exact: Network, model: Model, frames: Frames) -> Iterator[tuple[str, float, float]]:
    """Output name, largest difference and what is allowed, for two calls in a row."""
    batch = len(frames[0])
    inputs = [torch.from_numpy(array) for array in frames]
    precise = [array.double() for array in inputs]
    theirs, ours = model.zero_states(batch), network.zero_states(batch)
    best = {name: state.double() for name, state in exact.zero_states(batch).items()}
    for _ in range(2):
        outputs = model.run(*frames, theirs)
        with torch.no_grad():
            expected, ideal = network(*inputs, ours), exact(*precise, best)
        theirs, ours, best = outputs.states, expected.states, ideal.states
        triples = {
            INTENSITY: (outputs.intensity, expected.intensity, ideal.intensity),
            INTENSITY_BY_EMOTION: (
                outputs.intensity_by_emotion, expected.intensity_by_emotion, ideal.intensity_by_emotion,
            ),
            **{NEXT + name: (theirs[name], ours[name], best[name]) for name in theirs},
        }  # fmt: skip
        for name, (actual, wanted, true) in triples.items():
            reference = wanted.numpy()
            yield name, _apart(actual, reference), _allowed(_apart(reference, true.numpy()))


def _apart(actual: npt.NDArray[Any], reference: npt.NDArray[Any]) -> float:
    """The largest difference, relative beyond 1."""
    return float((np.abs(actual - reference) / np.maximum(1.0, np.abs(reference))).max())


def _allowed(rounding: float) -> float:
    """What two ways to compute may differ by, where torch's own rounding is so large."""
    return min(max(TOLERANCE, ROUNDING * rounding), MOST)


def _cases(random: np.random.Generator) -> Iterator[tuple[str, Frames]]:
    yield "random turns", _frames(random, _unit(random.standard_normal((33, 97, len(JOINTS), 4))))
    yield "one frame", _frames(random, _unit(random.standard_normal((1, 1, len(JOINTS), 4))))
    yield "large batch", _frames(random, _unit(random.standard_normal((301, 3, len(JOINTS), 4))))
    start = random.standard_normal((4, 1, len(JOINTS), 4))
    walk = start + 0.02 * random.standard_normal((4, 400, len(JOINTS), 4)).cumsum(1)
    yield "small steps", _frames(random, _unit(walk))
    flips = random.choice([-1.0, 1.0], (4, 400, len(JOINTS), 1))
    yield "small steps in flipped hemispheres", _frames(random, _unit(walk) * flips)
    edges = edge_rotations()
    yield "edges", _frames(random, edges[random.integers(len(edges), size=(17, 60, len(JOINTS)))])
    near = edges[random.integers(len(edges), size=(17, 60, len(JOINTS)))]
    yield "near edges", _frames(random, near + random.normal(0, 1e-4, near.shape))
    lost = _unit(random.standard_normal((9, 40, len(JOINTS), 4)))
    lost[random.random(lost.shape[:3]) < 0.3] = 0.0
    yield "zero quaternions", _frames(random, lost)
    yield "nothing seen", _frames(random, np.zeros((2, 5, len(JOINTS), 4)))


def edge_rotations() -> npt.NDArray[np.float64]:
    """Rotations where formulas break: [n, 4] xyzw. Quarter and half turns about axes and diagonals, both signs, zero.

    Roll, pitch and yaw of multiples of 90° give gimbal lock and ±π; negative zeros are among them.
    """
    quarters = np.deg2rad([-180.0, -90.0, 0.0, 90.0, 180.0]) / 2
    turns = []
    for roll, pitch, yaw in product(quarters, repeat=3):
        (sa, ca), (sb, cb), (sc, cc) = ((np.sin(angle), np.cos(angle)) for angle in (roll, pitch, yaw))
        turns.append(
            (
                sa * cb * cc - ca * sb * sc,
                ca * sb * cc + sa * cb * sc,
                ca * cb * sc - sa * sb * cc,
                ca * cb * cc + sa * sb * sc,
            )
        )
    exact = [signs for signs in product((-1.0, -0.0, 0.0, 1.0), repeat=4) if any(signs)]
    halves = [tuple(0.5 * sign for sign in signs) for signs in product((-1.0, 1.0), repeat=4)]
    return np.concatenate([turns, _unit(np.asarray(exact)), halves, np.zeros((1, 4))])


def _unit(quaternions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    unit: npt.NDArray[np.float64] = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return unit


def _frames(random: np.random.Generator, rotations: npt.NDArray[np.float64]) -> Frames:
    """Add masks and emotions: one-hot, mixed, partial and unknown ones."""
    batch, time = rotations.shape[:2]
    mask = random.random((batch, time, len(JOINTS))) < 0.9
    emotion = random.dirichlet(np.ones(len(EMOTIONS)), (batch, time)) * random.choice([0.0, 0.5, 1.0], (batch, time, 1))
    emotion[::2] = np.eye(len(EMOTIONS))[random.integers(len(EMOTIONS), size=emotion[::2].shape[:2])]
    return rotations.astype(np.float32), mask.astype(np.float32), emotion.astype(np.float32)
