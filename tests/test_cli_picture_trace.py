"""What a picture shows: runs, gaps, moments, and joints that were not seen."""

import numpy as np
import pytest

from fervor.cli.picture.trace import (
    Span,
    emotion_of,
    gaps,
    last_seen,
    level_of,
    moments,
    spans,
    status_of,
    stretches,
)
from pictures import RATE_HZ, estimate, trace, waving


def test_a_run_ends_where_the_next_begins():
    said = [estimate(n, emotion="joy" if n < 10 else "pride") for n in range(20)]
    assert spans(said, emotion_of) == [Span(0.0, 10 / RATE_HZ, "joy"), Span(10 / RATE_HZ, 19 / RATE_HZ, "pride")]


def test_a_gap_ends_a_run_and_is_told():
    said = [estimate(n) for n in range(60) if not 20 <= n < 50]
    assert [len(stretch) for stretch in stretches(said)] == [20, 10]
    (gap,) = gaps(said)
    assert (gap.start, gap.end, gap.text) == (19 / RATE_HZ, 50 / RATE_HZ, "gap 1.0 s")
    assert spans(said, emotion_of) == [Span(0.0, gap.start, "joy"), Span(gap.end, 59 / RATE_HZ, "joy")]


def test_what_is_interpolated_is_no_gap():
    assert gaps([estimate(n) for n in (0, 7, 14)]) == []  # 0.233 s apart


def test_no_pose_has_no_level():
    said = [estimate(n, None if n < 5 else 0.7) for n in range(10)]
    assert spans(said, level_of) == [Span(5 / RATE_HZ, 9 / RATE_HZ, "strong")]


def test_late_and_repeated_answers_are_no_points_of_the_curve():
    said = [estimate(0), estimate(2), estimate(1, flags=("late",)), estimate(2, flags=("duplicate",)), estimate(3)]
    assert [one.seq for one in trace(said).curve] == [0, 2, 3]


def test_a_status_says_what_is_remarkable():
    assert status_of(estimate(0, flags=("between_steps",))) == "ok"
    assert status_of(estimate(0, status="warming_up", flags=("gap_reset",))) == "warming up, gap reset"


def test_moments_are_even_and_none_lies_in_a_gap():
    whole = trace([estimate(n) for n in range(121)])
    assert moments(whole, 4) == [15, 45, 75, 105]
    holed = trace([estimate(n) for n in range(121) if not 29 <= n < 62])
    assert [round(holed.times[frame] * RATE_HZ) for frame in moments(holed, 8)] == [7, 22, 67, 82, 97, 112]


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_recordings_draw_each_frame_once(frames: int):
    short = trace([estimate(n) for n in range(frames)])
    assert moments(short, 12) == list(range(frames))
    assert short.end_s > short.start_s


def test_an_unseen_joint_keeps_its_last_pose():
    poses = waving(9)
    hidden = poses.copy()
    hidden[:3, 3] = np.nan
    hidden[5:, 3] = np.nan
    held = last_seen(hidden)
    assert np.array_equal(held[:3, 3], np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))
    assert np.array_equal(held[3:5], poses[3:5])
    assert np.array_equal(held[5:, 3], np.tile(poses[4, 3], (4, 1)))
