"""What a contestant has to answer: the model, run over a whole motion at once.

Written from the rules (docs/explanation/live-body.md), not from the service's code, which it is to judge.
"""

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.model import Floats, Model, default_model_path
from fervor.rotations import slerp
from fervor_bench.traffic import Traffic

LIFE_S, FADE_S = 8.0, 0.5
"""Of a state where a body has two: how long it lives, and how long its end fades into the other."""

SAME_INSTANT_S = 1e-6

Doubles = npt.NDArray[np.float64]


def expected_intensities(traffic: Traffic, pictures: int, *, grid: bool, states: int) -> Doubles:
    """The intensity after each picture of the first variant: [picture].

    Args:
        traffic: of one body of the rig's 13 joints.
        pictures: how many, at most a cycle of the motion.
        grid: whether poses are put on the model's grid by their times; else every picture is a step.
        states: of a body: one for ever, or two in turn.
    """
    model = Model.load(default_model_path())
    rotations = traffic.motion(0)[:pictures]  # [picture, joint, 4]
    newest = np.arange(pictures)  # [picture] newest step
    if grid:
        rotations, newest = on_grid(rotations, traffic.times(0, pictures), model.metadata.rate_hz)
    by_step = (_two_states if states == 2 else _one_state)(model, rotations, traffic.emotion)
    return by_step[newest]


def on_grid(
    rotations: Floats,  # [picture, joint, 4]
    times: Doubles,  # [picture] seconds, rising
    rate_hz: float,
) -> tuple[Floats, npt.NDArray[np.intp]]:
    """Poses at the steps of a grid that begins with the first picture, and each picture's newest step by then."""
    grid = times[0] + np.arange(int((times[-1] - times[0] + SAME_INSTANT_S) * rate_hz) + 1) / rate_hz  # [step]
    after = np.searchsorted(times + SAME_INSTANT_S, grid)  # [step] the picture that brings it
    before = np.maximum(after - 1, 0)
    gap = np.where(after > 0, times[after] - times[before], 1.0)
    fraction = np.clip((grid - times[before]) / gap, 0.0, 1.0)  # of the first: any, both poses are the same
    poses = slerp(rotations[before].astype(np.float64), rotations[after].astype(np.float64), fraction[:, None])
    return poses.astype(np.float32), np.searchsorted(grid, times + SAME_INSTANT_S, side="right") - 1


def _two_states(model: Model, rotations: Floats, emotion: str) -> Doubles:
    """States that live `LIFE_S`, one begun every half of that; the older speaks until it hands over: [step]."""
    half, fade = round(LIFE_S * model.metadata.rate_hz / 2), round(FADE_S * model.metadata.rate_hz)  # steps
    rising = np.maximum(np.arange(half) - (half - fade - 1), 0) / (fade + 1)  # the younger's share
    life = np.concatenate([rising, 1.0 - rising])
    by_step = np.zeros(len(rotations))
    for begin in range(0, len(rotations), half):
        share = life if begin else np.concatenate([np.ones(half), life[half:]])  # the first has nobody beside it
        heard = _one_state(model, rotations[begin : begin + 2 * half], emotion)
        by_step[begin : begin + 2 * half] += share[: len(heard)] * heard
    return by_step


def _one_state(model: Model, rotations: Floats, emotion: str) -> Doubles:
    """A state that begins with the first pose: [step]."""
    vector = np.zeros((1, len(rotations), len(EMOTIONS)), np.float32)
    if emotion in EMOTIONS:
        vector[..., EMOTIONS.index(emotion)] = 1.0
    mask = np.ones((1, *rotations.shape[:2]), np.float32)
    outputs = model.run(rotations[None], mask, vector, model.zero_states(1))
    return np.asarray(outputs.intensity[0], np.float64)
