"""Hysteresis and dwell."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from fervor.levels import Level, LevelState, levels_over_time, next_level

RULE = {"threshold": 0.5, "hysteresis": 0.05, "dwell": 1.0}


def run(values, dt=0.1):
    state, levels = None, []
    for index, value in enumerate(values):
        state = next_level(state, intensity=value, time=index * dt, **RULE)
        levels.append(state.level)
    return levels


def test_first_is_strong_above_the_band_at_once():
    assert run([0.5 + 0.05]) == [Level.STRONG]
    assert run([0.54]) == run([0.5]) == run([0.49]) == [Level.WEAK]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=100))
def test_strong_never_begins_inside_the_band(values):
    levels = [Level.WEAK, *run(values)]
    for value, before, level in zip(values, levels[:-1], levels[1:], strict=True):
        assert level is before or value >= 0.5 + 0.05 or (level is Level.WEAK and value < 0.5 - 0.05)


def test_noise_inside_the_band_changes_nothing():
    assert set(run([0.4] + [0.54, 0.46] * 40)) == {Level.WEAK}


def test_a_clear_change_waits_for_the_dwell():
    levels = run([0.2, *[0.9] * 20])
    assert levels.index(Level.STRONG) == 10


def test_falling_needs_the_lower_edge():
    assert run([0.9] * 15 + [0.46] * 15)[-1] is Level.STRONG
    assert run([0.9] * 15 + [0.44] * 15)[-1] is Level.WEAK


@given(st.lists(st.floats(0, 1), min_size=2, max_size=200))
def test_changes_are_never_closer_than_the_dwell(values):
    state, changes = None, []
    for index, value in enumerate(values):
        following = next_level(state, intensity=value, time=index / 30, **RULE)
        if state is not None and following.level is not state.level:
            changes.append(index / 30)
        state = following
    assert all(b - a >= RULE["dwell"] - 1e-9 for a, b in itertools.pairwise(changes))


EDGES = st.sampled_from([0.0, 0.44, 0.45, 0.5 - 0.05, 0.5, 0.55, 0.5 + 0.05, 0.56, 1.0])


@given(st.lists(st.tuples(EDGES | st.floats(0, 1), st.sampled_from([0.0, 0.1, 0.5, 1.0])), max_size=100))
def test_over_time_is_one_after_the_other(values):
    intensities = [intensity for intensity, _ in values]
    times = list(itertools.accumulate(gap for _, gap in values))
    state, levels = None, []
    for intensity, time in zip(intensities, times, strict=True):
        state = next_level(state, intensity=intensity, time=time, **RULE)
        levels.append(state.level)
    assert levels_over_time(intensities, times, **RULE) == levels


def test_level_values_are_the_wire_words():
    assert LevelState(Level.WEAK, 0.0).level == "weak"
    assert Level.STRONG == "strong"
