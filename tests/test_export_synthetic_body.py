"""Whole bodies: directions of the joints, ranges of motion, and that the rate only samples the same motion."""

import dataclasses

import numpy as np
import pytest

from fervor import rotations
from fervor.emotions import EMOTIONS
from fervor.skeletons.rig import JOINTS
from fervor_export.synthetic.motion import STARTLING, constant, synthesise_motion
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.scene import Posture, Scene

UP, FRONT, DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


def joint(motion: np.ndarray, name: str) -> np.ndarray:
    return motion[:, JOINTS.index(name)]


def chain(motion: np.ndarray, *names: str) -> np.ndarray:
    turn = rotations.identity((len(motion),))
    for name in names:
        turn = rotations.multiply(turn, joint(motion, name))
    return turn


def take(emotion: str, level: float, seed: int, posture: Posture = "stand", *, rate: float = 30.0):
    scene = Scene.draw(np.random.default_rng(seed), posture)
    events = (1.5,) if emotion in STARTLING else ()
    _, motion = synthesise_motion(
        emotion=emotion, intensity=level, seconds=5.0, seed=seed, scene=scene, events=events, rate_hz=rate
    )
    return motion


def test_sad_heads_and_chests_sink_forward_and_proud_ones_rise() -> None:
    def nose(emotion: str) -> float:
        turns = [chain(take(emotion, 1.0, seed), "spine", "chest", "head") for seed in range(12)]
        return float(np.mean([rotations.rotate(turn, FRONT)[:, 1] for turn in turns]))

    def breastbone(emotion: str) -> float:
        turns = [chain(take(emotion, 1.0, seed), "spine", "chest") for seed in range(12)]
        return float(np.mean([rotations.rotate(turn, UP)[:, 2] for turn in turns]))

    assert nose("sadness") < -0.4 < nose("pride")
    assert breastbone("sadness") > 0.25
    assert breastbone("pride") < 0.0


def test_sitting_knees_are_bent_back_and_thighs_lie_forward() -> None:
    motion = take("neutral", 0.5, 3, "sit")
    knee = np.degrees(rotations.to_rotvec(joint(motion, "l_knee")))
    assert (knee[:, 0] > 60.0).all()
    assert np.abs(knee[:, 1:]).max() < 1e-6
    shank = rotations.rotate(joint(motion, "r_knee"), DOWN)
    assert (shank[:, 2] < -0.6).all()  # from a forward thigh's own view the shank goes back
    hip = rotations.rotate(joint(motion, "l_hip"), DOWN)
    assert (hip[:, 2] > 0.5).all()


def test_walking_legs_and_arms_swing_in_opposition() -> None:
    scene = dataclasses.replace(Scene.draw(np.random.default_rng(1), "walk", "listen"), rest=0.0)
    person = dataclasses.replace(Person.draw(np.random.default_rng(1), "walker"), rate=0.01)
    _, motion = synthesise_motion(
        emotion="neutral", intensity=0.0, seconds=10.0, seed=5, person=person, scene=scene, rate_hz=60.0
    )
    left, right = (rotations.rotate(joint(motion, f"{side}_hip"), DOWN)[:, 2] for side in "lr")
    assert np.corrcoef(left, right)[0, 1] < -0.8
    arm = rotations.rotate(chain(motion, "spine", "chest", "l_shoulder"), DOWN)[:, 2]
    assert np.corrcoef(arm, left)[0, 1] < -0.5
    knee = np.degrees(rotations.to_rotvec(joint(motion, "l_knee")))[:, 0]
    assert knee.min() >= 0.0
    assert 45.0 < knee.max() < 85.0
    steps = np.abs(np.fft.rfft(left - left.mean()))
    assert 0.7 < steps.argmax() / 10.0 < 1.2  # strides a second


LIMITS = {"spine": 65, "chest": 58, "head": 90, "l_elbow": 175, "l_wrist": 75, "l_hip": 130, "l_knee": 141}
"""Degrees that no turn of a joint exceeds (elbows: flexion and pronation together)."""


@pytest.mark.parametrize("posture", ["stand", "sit", "walk"])
def test_joints_stay_within_their_ranges(posture: Posture) -> None:
    for seed, emotion in enumerate(EMOTIONS):
        motion = take(emotion, 1.0, seed, posture)
        assert np.isfinite(motion).all()
        assert np.allclose(rotations.length(motion), 1.0)
        for name, limit in LIMITS.items():
            for side in ("l", "r") if name.startswith("l_") else ("",):
                angle = np.degrees(rotations.length(rotations.to_rotvec(joint(motion, side + name[len(side) :]))))
                assert angle.max() <= limit, (emotion, name)


def test_bodies_move_as_fast_as_people_and_no_faster() -> None:
    peaks, medians = [], []
    for seed in range(44):
        motion = take(EMOTIONS[seed % 11], 0.9, seed, ("stand", "sit", "walk")[seed % 3], rate=60.0)
        step = rotations.multiply(rotations.conjugate(motion[:-1]), motion[1:])
        speed = np.degrees(rotations.length(rotations.to_rotvec(step)))[:, :9] * 60.0
        peaks.append(np.percentile(speed, 99.5))
        medians.append(np.median(speed))
    assert 100.0 < np.median(peaks) < 1200.0
    assert max(peaks) < 2000.0
    assert 5.0 < np.median(medians) < 100.0


def test_another_rate_samples_the_same_motion() -> None:
    slow, fast = (take("joy", 0.8, 4, "walk", rate=rate) for rate in (30.0, 120.0))
    angle = np.degrees(rotations.angle_between(slow, fast[::4]))
    assert np.median(angle) < 0.1
    assert angle.max() < 8.0  # noise that follows the hands' speed is measured on the frames themselves


def test_the_same_seed_gives_the_same_motion_and_another_does_not() -> None:
    first, again, other = (take("anger", 0.7, seed) for seed in (8, 8, 9))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_intensity_may_change_over_time() -> None:
    scene = Scene.draw(np.random.default_rng(0), "stand", "talk")
    arguments = {"emotion": "sadness", "seconds": 6.0, "seed": 2, "scene": scene}
    _, rising = synthesise_motion(intensity=lambda times: np.clip(times / 6.0, 0.0, 1.0), **arguments)
    bend = np.degrees(rotations.to_rotvec(joint(rising, "chest")))[:, 0]
    assert bend[-30:].mean() > bend[:30].mean() + 5.0
    _, steady = synthesise_motion(intensity=0.4, **arguments)
    _, same = synthesise_motion(intensity=constant(0.4), **arguments)
    assert np.array_equal(steady, same)


def spearman(x: np.ndarray, y: np.ndarray) -> float:
    rank = [np.argsort(np.argsort(values)) for values in (x, y)]
    return float(np.corrcoef(*rank)[0, 1])


def pitch(motion: np.ndarray, *names: str) -> float:
    return float(sum(np.degrees(rotations.to_rotvec(joint(motion, name)))[:, 0].mean() for name in names))


def yaw(motion: np.ndarray) -> float:
    return float(abs(np.degrees(rotations.to_rotvec(joint(motion, "head")))[:, 1].mean()))


def speeds(motion: np.ndarray, *names: str) -> np.ndarray:
    step = rotations.multiply(rotations.conjugate(motion[:-1]), motion[1:])
    turned = np.degrees(rotations.length(rotations.to_rotvec(step))) * 30.0
    return turned[:, [JOINTS.index(name) for name in names]]


ARMS = ("l_shoulder", "l_elbow", "r_shoulder", "r_elbow")


def arm_speed(motion: np.ndarray) -> float:
    return float(np.log(speeds(motion, *ARMS).mean()))


def shaking(motion: np.ndarray) -> float:
    wave = np.degrees(rotations.to_rotvec(joint(motion, "chest")))[:, 0]
    power = np.abs(np.fft.rfft(wave - wave.mean())) ** 2
    hertz = np.fft.rfftfreq(len(wave), 1.0 / 30.0)
    return float(np.log(power[(hertz > 3.8) & (hertz < 6.0)].sum()))


def trembling(motion: np.ndarray) -> float:
    bend = np.diff(np.degrees(rotations.to_rotvec(joint(motion, "l_wrist"))), n=2, axis=0)
    return float(np.log(np.median(np.abs(bend))))


def slump(motion: np.ndarray) -> float:
    return pitch(motion, "chest", "head")


MEASURES = [
    ("joy", arm_speed, 1), ("anger", arm_speed, 1), ("sadness", arm_speed, -1), ("sadness", slump, 1),
    ("shame", slump, 1), ("pride", slump, -1), ("disgust", yaw, 1), ("amusement", shaking, 1), ("fear", trembling, 1),
    ("relief", lambda m: float(np.degrees(rotations.to_rotvec(joint(m, "chest")))[:, 0].std()), 1),
    ("surprise", lambda m: float(np.log(speeds(m, "spine", "chest").max())), 1),
]  # fmt: skip


@pytest.mark.parametrize(("emotion", "measure", "sign"), MEASURES)
def test_what_shows_grows_with_intensity_over_many_people(emotion: str, measure, sign: int) -> None:
    levels = np.linspace(0.0, 1.0, 80)
    seen = np.array([measure(calm(emotion, level, 100 + index)) for index, level in enumerate(levels)])
    assert sign * spearman(levels, seen) > 0.35


def calm(emotion: str, level: float, seed: int) -> np.ndarray:
    """A take in which the task itself is neither lively nor slow, so that fewer people are enough to see the rest."""
    scene = dataclasses.replace(Scene.draw(np.random.default_rng(seed), "stand"), vigour=1.0)
    events = (1.5,) if emotion in STARTLING else ()
    return synthesise_motion(emotion=emotion, intensity=level, seconds=5.0, seed=seed, scene=scene, events=events)[1]
