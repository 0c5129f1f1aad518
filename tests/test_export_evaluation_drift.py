"""Long streams: joined as promised, remembered as the session remembers, and drift is seen where there is some."""

from dataclasses import dataclass

import numpy as np
import pytest

from fervor.session import lanes
from fervor_export.evaluation import drift as module
from fervor_export.evaluation.drift import FADE_S, PERIOD_S, concatenate, drift, staggered
from fervor_export.evaluation.estimator import NetworkEstimator
from networks import network, waving_clips

CLIPS = waving_clips(30)


@dataclass
class Counting:
    """Estimates how long it has been running: minutes since its reset."""

    def estimate(self, motions):
        return [np.tile(np.arange(len(motion))[:, None] / 1800.0, (1, 12)).astype(np.float32) for motion in motions]


@dataclass
class Constant:
    def estimate(self, motions):
        return [np.full((len(motion), 12), 0.4, np.float32) for motion in motions]


def test_a_stream_is_as_long_as_asked_and_moves_on_smoothly():
    stream = concatenate(CLIPS[:3], minutes=1, random=np.random.default_rng(0))
    assert len(stream.motion) == len(stream.label) == len(stream.clip) == 1800
    between = np.flatnonzero(stream.clip < 0)
    assert len(between) >= 12
    first = stream.clips[0]
    np.testing.assert_array_equal(stream.motion.rotations[: first.frames], first.rotations)
    assert (stream.clip[: first.frames] == 0).all()
    assert (stream.age[: first.frames] == np.arange(first.frames)).all()


def test_the_sessions_times_are_ours():
    assert (lanes.PERIOD_S, lanes.FADE_S) == (PERIOD_S, FADE_S)


@pytest.mark.parametrize("estimator", [Counting(), NetworkEstimator(network())])
def test_staggered_memory_is_the_sessions(estimator):
    """Lane by lane and step by step, as the schedule of the session says."""
    stream = concatenate(CLIPS, minutes=0.6, random=np.random.default_rng(0))
    frames = len(stream.motion)
    expected, starts, cache = np.zeros(frames), {}, {}
    for index in range(frames):
        for step in lanes.schedule("staggered", index, 30.0):
            if step.restart:
                starts[step.lane] = index
                cache[step.lane] = estimator.estimate(
                    [
                        module.Motion(
                            stream.motion.rotations[index : index + 300], stream.motion.mask[index : index + 300]
                        )
                    ]
                )[0]
            value = cache[step.lane][index - starts[step.lane], stream.label[index]]
            expected[index] += step.weight * value
    np.testing.assert_allclose(staggered(estimator, [stream])[0], expected, atol=1e-5)


def test_drift_is_seen_where_there_is_some():
    found = {entry.memory: entry for entry in drift([(Counting(), CLIPS)], minutes=3, streams=2)}
    assert found["stateful"].slope == pytest.approx(1.0, abs=0.02)
    assert found["stateful"].slope_low <= found["stateful"].slope <= found["stateful"].slope_high
    assert [round(minute.p50, 1) for minute in found["stateful"].minutes] == [0.5, 1.5, 2.5]
    assert abs(found["staggered"].slope) < 0.01
    assert found["staggered"].minutes[2].p95 < 0.15


def test_a_constant_does_not_drift_and_has_no_r():
    for entry in drift([(Constant(), CLIPS[:1])], minutes=2, streams=1):
        assert (entry.slope, entry.apart, entry.slope_low) == (0.0, 0.0, None)
        assert all(minute.r is None for minute in entry.minutes)
