"""What makes a trial count."""

import numpy as np
import pytest

from fervor_bench.generator import Load, Seen
from fervor_bench.trial import Used, conclude

WINDOW = (10.0, 12.0)


def seen(**changes) -> Seen:
    fields = {
        "sessions": 10,
        "refused": 0,
        "closed": 0,
        "errors": 0,
        "first_error": "",
        "frames": 1000,
        "unanswered": 0,
        "under_way": 0,
        "checkpoints": 0,
        "blocked": 0,
        "dry": False,
        "lost": False,
        "window_s": 2.0,
        "busy_s": 0.2,
        "latencies": np.full(1000, 500, np.float32),
        "lags": np.full(1000, 20, np.float32),
    }
    return Seen(**(fields | changes))


def test_costs_are_processor_time_by_frames() -> None:
    trial = conclude(Load(10), seen(), Used(0.5, 0.6, WINDOW))
    assert (trial.server_us, trial.server_share, trial.frames_per_second) == (500.0, 0.25, 500.0)
    assert trial.others_share == pytest.approx(0.05)
    assert trial.window == WINDOW
    assert trial.valid
    assert trial.keeps(10.0)
    assert not trial.keeps(0.5)


def test_a_service_elsewhere_has_no_costs() -> None:
    trial = conclude(Load(10), seen(), None)
    assert trial.server_us is trial.server_share is trial.others_share is trial.window is None


@pytest.mark.parametrize(
    ("load", "changes", "used", "objection"),
    [
        (Load(10), {"lags": np.full(1000, 2100, np.float32)}, Used(1.0, 1.0, WINDOW), "lagged"),
        (Load(1, waits="spin"), {"lags": np.full(30, 1100, np.float32)}, Used(1.0, 1.0, WINDOW), "lagged"),
        (Load(10), {"busy_s": 1.96}, Used(1.0, 1.0, WINDOW), "98% of its processor"),
        (Load(10), {}, Used(1.0, 1.5, WINDOW), "others used 25% of the contestant's processor"),
        (Load(10, arrivals="lockstep"), {"lags": np.full(1000, 11000, np.float32)}, Used(1.0, 1.0, WINDOW), "lagged"),
    ],
)
def test_what_the_contestant_is_not_to_blame_for_is_objected_to(load, changes, used, objection) -> None:
    trial = conclude(load, seen(**changes), used)
    assert not trial.valid
    assert objection in trial.objections[0]


def test_lockstep_and_closed_loops_are_judged_by_their_own_measure() -> None:
    assert conclude(Load(10, arrivals="lockstep"), seen(lags=np.full(1000, 1500, np.float32)), None).valid
    assert conclude(Load(10, loop="closed"), seen(busy_s=1.99, lags=np.zeros(0, np.float32)), None).valid


def test_who_fell_behind_keeps_nothing() -> None:
    trial = conclude(Load(10), seen(lost=True), None)
    assert trial.lost
    assert not trial.keeps(1e9)
    # Before its window began: nothing was answered in it, and that is no failure of its own.
    assert conclude(Load(10), seen(lost=True, frames=0, window_s=0.0), None).failures == ()


@pytest.mark.parametrize("changes", [{"refused": 1}, {"closed": 1}, {"errors": 1}, {"frames": 0}])
def test_sessions_that_were_not_served_are_failures(changes) -> None:
    assert not conclude(Load(10), seen(**changes), None).keeps(1e9)
