"""The grid: which steps a pose brings, by times alone."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.session.timeline import HOLD_S, INTERPOLATE_S, Timeline, advance, begin, count_frame

RATE = 30.0


def walk(times: list[float]) -> list:
    timeline, moves = None, []
    for time in times:
        moves.append(advance(timeline, time, rate_hz=RATE))
        timeline = moves[-1].timeline
    return moves


def test_first_pose_is_step_zero_and_starts_anew():
    move = advance(None, 12.5, rate_hz=RATE)
    assert move == begin(12.5)
    assert move.fresh
    assert [(i.index, i.time, i.fraction) for i in move.instants] == [(0, 12.5, 1.0)]


@pytest.mark.parametrize("rate", [15, 24, 25, 30, 50, 60, 100, 120, 240])
def test_any_client_rate_gives_thirty_steps_a_second(rate):
    moves = walk([index / rate for index in range(10 * rate + 1)])
    assert sum(len(move.instants) for move in moves) == pytest.approx(10 * RATE + 1, abs=1)


def test_sixty_hertz_steps_on_every_other_frame_and_says_so():
    moves = walk([index / 60 for index in range(6)])
    assert [len(move.instants) for move in moves] == [1, 0, 1, 0, 1, 0]
    assert moves[1].flags == ("between_steps",)
    assert moves[2].flags == ()


def test_a_frame_on_the_grid_takes_its_own_pose_in_spite_of_rounding():
    for start in (0.0, 1.7e9 / 3, 0.1):
        moves = walk([start + index * (1 / 30) for index in range(300)])
        assert all([round(i.fraction, 4) for i in move.instants] == [1.0] for move in moves)


def test_short_gap_is_interpolated_long_gap_held_longer_one_resets():
    base = Timeline(0.0, 0.0, 1)
    short = advance(base, 0.2, rate_hz=RATE)
    assert short.flags == ("interpolated",)
    assert [i.held for i in short.instants] == [False] * 6
    held = advance(base, 0.8, rate_hz=RATE)
    assert held.flags == ("held",)
    assert [i.held for i in held.instants] == [True] * 23 + [False]  # the pose itself lies on the grid and counts
    gone = advance(base, 5.0, rate_hz=RATE)
    assert gone.flags == ("gap_reset",)
    assert gone.fresh


@pytest.mark.parametrize(("gap", "flag"), [(INTERPOLATE_S, "interpolated"), (HOLD_S, "held")])
def test_limits_belong_to_the_milder_case(gap, flag):
    assert advance(Timeline(0.0, 0.0, 1), gap, rate_hz=RATE).flags == (flag,)


def test_late_and_backward_clocks():
    base = Timeline(0.0, 10.0, 301)
    late = advance(base, 9.99, rate_hz=RATE)
    assert late.flags == ("late",)
    assert late.timeline == base
    assert advance(base, 10.0, rate_hz=RATE).flags == ("late",)
    back = advance(base, 2.0, rate_hz=RATE)
    assert back.flags == ("clock_reset",)
    assert back.fresh


def test_clock_frames_steps_once_a_frame_whatever_the_times():
    timeline = count_frame(None, 5.0).timeline
    for index, time in enumerate((5.0, 4.0, 900.0), 1):
        move = count_frame(timeline, time)
        assert [(i.index, i.fraction, i.held) for i in move.instants] == [(index, 1.0, False)]
        timeline = move.timeline


@given(st.lists(st.floats(1e-4, 3.0), min_size=1, max_size=80), st.floats(-1e6, 1e6))
def test_steps_are_consecutive_and_lie_between_their_poses(gaps, start):
    times = [start]
    for gap in gaps:
        times.append(times[-1] + gap)
    timeline, expected = None, 0
    for before, time in zip([None, *times], times, strict=False):
        move = advance(timeline, time, rate_hz=RATE)
        expected = 0 if move.fresh else expected
        for instant in move.instants:
            assert instant.index == expected
            assert 0.0 <= instant.fraction <= 1.0
            assert instant.time <= time + 2e-6
            assert move.fresh or instant.time >= before - 2e-6
            expected += 1
        timeline = move.timeline
        assert timeline.steps == expected


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(allow_nan=False, allow_infinity=False))
def test_wild_times_never_bring_more_than_a_second_of_steps(first, second):
    moves = walk([first, second])
    assert all(len(move.instants) <= math.ceil(RATE * HOLD_S) + 1 for move in moves)
