"""Which recurrent state runs, restarts and speaks at every step."""

import itertools

import numpy as np
import pytest

from fervor.session.lanes import FADE_S, LANES, NO_LANES, PERIOD_S, lane_plan, lane_runs, lane_weights, schedule

RATE = 30.0


def test_stateful_is_one_lane_restarted_once():
    assert [(s.lane, s.restart, s.weight) for s in schedule("stateful", 0, RATE)] == [(0, True, 1.0)]
    for index in (1, 239, 240, 100_000):
        assert [(s.lane, s.restart, s.weight) for s in schedule("stateful", index, RATE)] == [(0, False, 1.0)]


@pytest.mark.parametrize("rate", [1.0, 10.0, 25.0, 30.0, 60.0])
def test_weights_add_up_and_lanes_restart_half_a_period_apart(rate):
    half = max(round(PERIOD_S * rate / 2), 1)
    restarts: dict[int, list[int]] = {0: [], 1: []}
    for index in range(8 * half):
        lanes = schedule("staggered", index, rate)
        assert sum(lane.weight for lane in lanes) == pytest.approx(1.0, abs=1e-15)
        for lane in lanes:
            if lane.restart:
                restarts[lane.lane].append(index)
    assert restarts == {0: [0, 2 * half, 4 * half, 6 * half], 1: [half, 3 * half, 5 * half, 7 * half]}


def test_the_elder_speaks_and_a_restarting_lane_is_silent():
    for index in range(240, 1000):
        lanes = {lane.lane: lane for lane in schedule("staggered", index, RATE)}
        for lane in lanes.values():
            if lane.restart:
                assert lane.weight == 0.0
        elder = 0 if index % 240 >= 120 else 1
        assert lanes[elder].weight > 0.0


def test_cross_fade_takes_half_a_second_in_equal_steps():
    heard = [schedule("staggered", index, RATE)[0].weight for index in range(120, 361)]
    fade = [weight for weight in heard if 0.0 < weight < 1.0]
    assert len(fade) == 2 * round(FADE_S * RATE)
    steps = [abs(b - a) for a, b in itertools.pairwise(heard)]
    assert max(steps) == pytest.approx(1 / (FADE_S * RATE + 1))


def test_first_four_seconds_run_one_lane_only():
    assert all(len(schedule("staggered", index, RATE)) == 1 for index in range(120))
    assert len(schedule("staggered", 120, RATE)) == 2


@pytest.mark.parametrize("memory", ["staggered", "stateful", "window"])
@pytest.mark.parametrize("rate", [1.0, 25.0, 30.0])
def test_the_plan_says_of_every_step_what_its_schedule_says(memory, rate):
    plan = lane_plan(rate)
    for index in [*range(round(3 * PERIOD_S * rate)), 100_000]:
        row = plan.row(memory, index)
        lanes = {step.lane: step for step in schedule(memory, index, rate)}
        for lane in range(LANES):
            step = lanes.get(lane)
            planned = (plan.runs[row, lane], plan.restart[row, lane], plan.weight[row, lane])
            assert planned == ((False, False, 0.0) if step is None else (True, step.restart, step.weight))
        assert (row in plan.full) == (len(lanes) == LANES)
        assert (row in plan.restarting) == any(step.restart for step in lanes.values())
        assert (row == NO_LANES) == (not lanes)


@pytest.mark.parametrize("memory", ["staggered", "stateful"])
@pytest.mark.parametrize("steps", [0, 1, 119, 120, 226, 240, 241, 700, 1000])
def test_lanes_over_time_are_the_schedule(memory, steps):
    weights = np.zeros((steps, 2))
    for index in range(steps):
        for lane in schedule(memory, index, RATE):
            weights[index, lane.lane] = lane.weight
    assert (lane_weights(memory, steps, RATE) == weights).all()
    heard = np.zeros((steps, 2), np.bool_)
    for run in lane_runs(memory, steps, RATE):
        assert any(lane.lane == run.lane and lane.restart for lane in schedule(memory, run.start, RATE))
        assert all(
            not lane.restart or lane.lane != run.lane
            for index in range(run.start + 1, run.stop)
            for lane in schedule(memory, index, RATE)
        )
        assert not heard[run.start : run.stop, run.lane].any()
        heard[run.start : run.stop, run.lane] = True
    assert heard[weights > 0].all()
