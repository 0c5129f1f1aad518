"""Streams built to break a live body, through the session and the engine: all that differs is what should."""

import resource
import sys
from pathlib import Path

import numpy as np
import pytest

from bodies import model, motion, terms
from fervor.emotions import EMOTIONS
from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.protocol.messages import Estimate
from fervor.session.body import Body
from fervor.session.events import Pose

ALL = np.ones(13, np.bool_)
RATE = 30.0


class Live:
    """One body and its engine."""

    def __init__(self, **agreed) -> None:
        self.engine = Engine(model(), capacity=1)
        self.body = Body("eve", self.engine.claim(), terms(**agreed))

    def see(self, seq: int, time: float, rotations: np.ndarray, *, observed=ALL, emotion=None) -> Estimate:
        ticket = self.body.plan(seq, time, Pose(rotations, observed), emotion=emotion)
        (outcome,) = self.engine.run([ticket])
        assert not isinstance(outcome, EngineError)
        return self.body.conclude(ticket, outcome)

    def watch(self, rotations: np.ndarray, *, rate: float = RATE, observed=None, emotion="joy") -> list[Estimate]:
        seen = np.ones(rotations.shape[:2], np.bool_) if observed is None else observed
        return [
            self.see(seq, seq / rate, q, observed=seen[seq], emotion=emotion if seq == 0 else None)
            for seq, q in enumerate(rotations)
        ]


def intensities(estimates) -> np.ndarray:
    return np.array([estimate.intensity for estimate in estimates])


def test_signs_of_quaternions_mean_nothing():
    rotations = motion(200)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (200, 13, 1))
    assert np.abs(intensities(Live().watch(rotations)) - intensities(Live().watch(rotations * signs))).max() < 1e-6


def test_time_running_backwards_resets_once_and_goes_on():
    live, rotations = Live(), motion(400)
    live.watch(rotations[:100])
    first = live.see(100, -5.0, rotations[100])
    assert first.flags == ("clock_reset",)
    assert first.status == "warming_up"
    rest = [live.see(101 + k, -5.0 + (k + 1) / RATE, rotations[101 + k]) for k in range(60)]
    assert all(not estimate.flags for estimate in rest)
    assert rest[-1].status == "ok"


def test_two_bodies_that_swap_ids_keep_their_own_states():
    one, other = Live(), Live()
    a, b = motion(90, seed=1), motion(90, seed=2)
    one.watch(np.concatenate([a[:60], b[60:]]))
    other.watch(np.concatenate([b[:60], a[60:]]))
    swapped = one.see(90, 3.0, b[89])
    assert swapped.intensity is not None
    assert 0.0 <= swapped.intensity <= 1.0


@pytest.mark.parametrize(("lost", "flag"), [(0.2, "interpolated"), (0.8, "held"), (5.0, "gap_reset")])
def test_all_joints_lost(lost, flag):
    rotations = motion(300)
    observed = np.ones((300, 13), np.bool_)
    gone = slice(100, 100 + round(lost * RATE) - 1)
    observed[gone] = False
    estimates = Live().watch(rotations, observed=observed)
    before = estimates[99].intensity
    for estimate in estimates[gone]:
        assert (estimate.status, estimate.intensity) == ("insufficient", before)
        assert "lost" in estimate.flags
    back = estimates[gone.stop]
    assert flag in back.flags
    assert back.status == ("warming_up" if flag == "gap_reset" else "ok")
    assert not estimates[gone.stop + 1].flags


def test_a_gap_without_frames_is_the_same_as_a_gap_of_empty_frames():
    rotations = motion(200)
    observed = np.ones((200, 13), np.bool_)
    observed[60:80] = False
    with_empty = Live().watch(rotations, observed=observed)
    silent = Live()
    without = [silent.see(k, k / RATE, rotations[k], emotion="joy") for k in range(200) if not 60 <= k < 80]
    assert intensities(with_empty[80:]).tolist() == intensities(without[60:]).tolist()


def test_a_missing_joint_is_held_and_masked():
    rotations = motion(120)
    observed = np.ones((120, 13), np.bool_)
    observed[60:, 4] = False
    stuck = rotations.copy()
    stuck[60:, 4] = np.nan_to_num(0.0)
    masked, zeroed = Live().watch(rotations, observed=observed), Live().watch(stuck, observed=observed)
    assert intensities(masked).tolist() == intensities(zeroed).tolist()
    assert {estimate.status for estimate in masked[60:]} == {"ok"}


def test_bursts_at_240_hertz_after_silences():
    live, rotations, time, seq = Live(), motion(1000), 0.0, 0
    for _ in range(10):
        for _ in range(48):
            estimate = live.see(seq, time, rotations[seq], emotion="joy")
            assert estimate.intensity is not None
            seq, time = seq + 1, time + 1 / 240
        time += 0.2
    assert "interpolated" in live.see(seq, time, rotations[seq]).flags


def test_a_label_that_changes_at_every_frame_never_touches_the_state():
    rotations = motion(240)
    steady, restless = Live(by_emotion=True), Live(by_emotion=True)
    calm = steady.watch(rotations)
    wild = [restless.see(k, k / RATE, q, emotion=EMOTIONS[k % 11]) for k, q in enumerate(rotations)]
    assert [e.by_emotion for e in calm] == [e.by_emotion for e in wild]
    for estimate in wild:
        assert estimate.by_emotion is not None
        assert estimate.intensity == pytest.approx(estimate.by_emotion[estimate.emotion], abs=1e-6)


def test_jitter_and_irregular_rates_stay_near_the_regular_stream():
    random = np.random.default_rng(3)
    steps = motion(30 * 12, speed=0.02)
    times = np.arange(len(steps)) / RATE
    jittered = times + random.uniform(-0.01, 0.01, len(times))
    live = Live()
    shaken = [live.see(k, float(t), q, emotion="joy") for k, (t, q) in enumerate(zip(jittered, steps, strict=True))]
    assert np.abs(intensities(shaken) - intensities(Live().watch(steps)))[30:].mean() < 0.03


def resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("memory", ["staggered", "stateful"])
def test_an_hour_neither_drifts_nor_grows(memory):
    """Simulated time. The same minute over and over: later minutes look like early ones, and memory stays."""
    live, minute = Live(memory=memory), motion(1800, speed=0.02)
    minute[900:] = minute[900:0:-1]  # there and back, so that minutes join smoothly
    laps, size = [], (0, 0)
    for lap in range(60):
        values = [
            live.see(lap * 1800 + k, (lap * 1800 + k) / RATE, q, emotion="joy").intensity for k, q in enumerate(minute)
        ]
        laps.append((np.mean(values), np.std(values)))
        size = (sys.getallocatedblocks(), resident_bytes()) if lap == 2 else size
    early, late = np.array(laps[1:11]), np.array(laps[-10:])
    assert np.abs(early.mean(axis=0) - late.mean(axis=0)).max() < 0.01
    assert sys.getallocatedblocks() - size[0] < 1000  # of Python's; fifty-seven minutes passed
    assert resident_bytes() - size[1] < 32_000_000  # of everybody's: the process ran other tests before
