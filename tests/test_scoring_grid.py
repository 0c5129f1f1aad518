"""The grid of a whole take is the timeline's, pose by pose, to the bit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fervor.scoring.grid import FLAGS, grid_of, rises
from fervor.session.timeline import advance, count_frame

RATE = 30.0
GAPS = st.sampled_from(
    [1e-7, 1e-6, 2e-6, 1 / 240, 1 / 120, 1 / 60, 1 / 30, 0.0333, 0.1, 0.25, 0.25 + 1e-6, 0.4, 1.0, 1.0 + 1e-6, 1.2, 9.0]
)


@given(st.lists(GAPS | st.floats(1e-6, 1.5), max_size=80), st.floats(-1e3, 1e3) | st.just(1.7e9), st.booleans())
def test_the_grid_is_the_timeline(gaps, origin, counted):
    times = origin + np.cumsum([0.0, *gaps])
    times = times[np.concatenate([[True], np.diff(times) > 0])]
    grid = grid_of(times, "frames" if counted else "time", RATE)
    line, step = None, 0
    for pose, time in enumerate(times.tolist()):
        moved = count_frame(line, time) if counted else advance(line, time, rate_hz=RATE)
        line = moved.timeline
        assert FLAGS[grid.flags[pose]] == moved.flags
        assert grid.since[pose] == line.origin
        assert (pose in grid.starts) == moved.fresh
        assert grid.moves[pose] == bool(moved.instants)
        for instant in moved.instants:
            assert grid.pose[step] == pose
            assert grid.fraction[step] == instant.fraction
            assert grid.held[step] == instant.held
            assert step - max(begin for begin, _ in grid.runs if begin <= step) == instant.index
            step += 1
        assert grid.last[pose] == step - 1
    assert step == len(grid.pose) == grid.first[-1]


def test_no_pose_brings_no_step():
    grid = grid_of(np.zeros(0), "time", RATE)
    assert (len(grid.pose), grid.runs, grid.pose_runs) == (0, [], [])


def test_times_that_stand_or_run_back_do_not_rise():
    assert rises(np.array([0.0, 0.1, 0.2]))
    assert not rises(np.array([0.0, 0.1, 0.1]))
    assert not rises(np.array([0.0, 0.1, 0.05]))
