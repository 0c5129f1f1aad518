"""The engine gives what the model gives on poses worked out by hand, and the same bits in any company."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from bodies import model, motion, terms
from fervor.emotions import emotion_vector
from fervor.engine.engine import MOST_STEPS, Engine
from fervor.errors import EngineError
from fervor.model import Model
from fervor.session.body import Body
from fervor.session.events import Outcome, Pose, Ticket

ALL = np.ones(13, np.bool_)


def plan(body: Body, rotations: np.ndarray, *, rate: float, start: float = 0.0) -> list[Ticket]:
    return [
        body.plan(seq, start + seq / rate, Pose(pose, ALL), emotion="joy" if seq == 0 else None)
        for seq, pose in enumerate(rotations)
    ]


def run_alone(engine: Engine, tickets: list[Ticket]) -> list[Outcome]:
    return [engine.run([ticket])[0] for ticket in tickets]


def intensities(outcomes) -> list[float]:
    return [outcome.intensity for outcome in outcomes]


def whole_sequence(rotations: np.ndarray) -> np.ndarray:
    """The model on a whole sequence of 30 Hz poses in one call: [frame]."""
    frames = len(rotations)
    return (
        model()
        .run(
            rotations[None].astype(np.float32),
            np.ones((1, frames, 13), np.float32),
            np.tile(emotion_vector("joy"), (1, frames, 1)),
            model().zero_states(1),
        )
        .intensity[0]
    )


def test_frame_by_frame_equals_one_call_to_the_bit():
    rotations = motion(100)
    engine = Engine(model(), capacity=1)
    tickets = plan(Body("a", engine.claim(), terms()), rotations, rate=30)
    assert intensities(run_alone(engine, tickets)) == whole_sequence(rotations).tolist()


@pytest.mark.parametrize("rate", [17, 60, 90, 120])
def test_other_rates_equal_the_model_on_scipys_slerp(rate):
    times = np.arange(5 * rate) / rate
    rotations = motion(len(times), speed=0.02)
    engine = Engine(model(), capacity=1)
    tickets = plan(Body("a", engine.claim(), terms()), rotations, rate=rate)
    outcomes = run_alone(engine, tickets)
    stepped = [outcome.intensity for ticket, outcome in zip(tickets, outcomes, strict=True) if ticket.steps]
    grid = np.arange(int(times[-1] * 30 + 1e-6) + 1) / 30
    slerps = [Slerp(times, Rotation.from_quat(rotations[:, joint])) for joint in range(13)]
    expected = whole_sequence(np.stack([slerp(np.minimum(grid, times[-1])).as_quat() for slerp in slerps], axis=1))
    ends = np.cumsum([len(ticket.steps) for ticket in tickets if ticket.steps]) - 1
    assert np.abs(expected[ends] - stepped).max() < 1e-5


def test_staggered_lanes_hand_over_to_the_younger_state():
    rotations = motion(400)
    engine = Engine(model(), capacity=1)
    outcomes = intensities(run_alone(engine, plan(Body("a", engine.claim(), terms()), rotations, rate=30)))
    elder, younger = whole_sequence(rotations[:240]), whole_sequence(rotations[120:360])
    assert outcomes[:225] == elder[:225].tolist()
    assert outcomes[240:345] == younger[120:225].tolist()
    half_way = 0.5 * elder[232] + 0.5 * younger[112]
    assert outcomes[232] == pytest.approx(half_way, abs=1e-7)


def test_stateful_never_restarts():
    rotations = motion(400)
    engine = Engine(model(), capacity=1)
    body = Body("a", engine.claim(), terms(memory="stateful"))
    assert intensities(run_alone(engine, plan(body, rotations, rate=30))) == whole_sequence(rotations).tolist()


def test_alone_or_beside_three_hundred_others_changes_no_bit():
    alone = Engine(model(), capacity=1)
    mine = motion(60, seed=999)
    expected = run_alone(alone, plan(Body("me", alone.claim(), terms()), mine, rate=40))
    crowd = Engine(model(), capacity=301)
    mine_again = plan(Body("me", crowd.claim(), terms()), mine, rate=40)
    names = ["c13", "ebmdb", "cmu"]
    others = []
    for number in range(300):
        agreed = terms(names[number % 3])
        joints = len(agreed.source.skeleton.joints)
        body = Body(str(number), crowd.claim(), agreed)
        rotations = motion(60, seed=number, joints=joints)
        others.append(
            [body.plan(seq, seq / (20 + number), Pose(q, np.ones(joints, np.bool_))) for seq, q in enumerate(rotations)]
        )
    random = np.random.default_rng(0)
    for seq, ticket in enumerate(mine_again):
        batch = [ticket, *(tickets[seq] for tickets in others)]
        order = random.permutation(len(batch))
        outcomes = crowd.run([batch[place] for place in order])
        got = outcomes[int(np.flatnonzero(order == 0)[0])]
        assert got.intensity == expected[seq].intensity
        assert np.array_equal(got.by_emotion, expected[seq].by_emotion)


def test_bodies_of_any_age_in_one_batch_change_no_bit():
    """One lane runs, then two, now and then one restarts, and some take no step or several."""
    rates, starts = (30, 30, 30, 24, 45, 30), (0, 40, 110, 0, 10, 0)
    expected = []
    for number, rate in enumerate(rates):
        engine = Engine(model(), capacity=1)
        memory = "stateful" if number == 5 else "staggered"
        body = Body(str(number), engine.claim(), terms(memory=memory))
        expected.append(run_alone(engine, plan(body, motion(260, seed=number), rate=rate)))
    engine = Engine(model(), capacity=6)
    bodies = [
        Body(str(number), engine.claim(), terms(memory="stateful" if number == 5 else "staggered"))
        for number in range(6)
    ]
    work = [plan(body, motion(260, seed=at), rate=rates[at]) for at, body in enumerate(bodies)]
    got: list[list[Outcome]] = [[] for _ in bodies]
    for turn in range(370):
        batch = [(at, tickets[turn - starts[at]]) for at, tickets in enumerate(work) if 0 <= turn - starts[at] < 260]
        for (at, _), outcome in zip(batch, engine.run([ticket for _, ticket in batch]) if batch else (), strict=True):
            got[at].append(outcome)
    for mine, theirs in zip(got, expected, strict=True):
        assert intensities(mine) == intensities(theirs)
        assert all(np.array_equal(a.by_emotion, b.by_emotion) for a, b in zip(mine, theirs, strict=True))


def test_a_crowd_beyond_one_call_of_the_model_changes_no_bit():
    rotations, crowd = motion(3), 2 * MOST_STEPS + 5
    alone, engine = Engine(model(), capacity=1), Engine(model(), capacity=crowd)
    expected = intensities(run_alone(alone, plan(Body("a", alone.claim(), terms()), rotations, rate=30)))
    work = [plan(Body(str(number), engine.claim(), terms()), rotations, rate=30) for number in range(crowd)]
    for seq in range(3):
        outcomes = engine.run([tickets[seq] for tickets in work])
        assert intensities(outcomes) == [expected[seq]] * crowd


def test_padding_to_a_row_multiple_changes_nothing_but_the_calls():
    rotations = motion(30)
    plain, padded = Engine(model(), capacity=1), Engine(model(), capacity=1, row_multiple=8)
    one = run_alone(plain, plan(Body("a", plain.claim(), terms()), rotations, rate=30))
    other = run_alone(padded, plan(Body("a", padded.claim(), terms()), rotations, rate=30))
    assert intensities(one) == intensities(other)


def test_a_slot_used_again_remembers_nothing():
    rotations = motion(30)
    engine = Engine(model(), capacity=1)
    first = run_alone(engine, plan(Body("a", engine.claim(), terms()), rotations, rate=30))
    engine.release(0)
    lost = Body("b", engine.claim(), terms())
    (empty,) = engine.run([lost.plan(0, 0.0, Pose(rotations[0], ~ALL))])
    assert empty.intensity is None
    second = run_alone(engine, plan(Body("c", 0, terms()), rotations, rate=30))
    assert intensities(first) == intensities(second)


class Failing:
    """A real model that fails whenever a row's first joint is marked."""

    def __init__(self) -> None:
        self.metadata = model().metadata

    def run(self, rotations, mask, emotion, states):
        if (mask[:, 0, 2] == 0.0).any():
            raise EngineError("marked")
        return model().run(rotations, mask, emotion, states)


def test_a_failing_row_fails_alone_and_changes_nothing():
    engine = Engine(Failing(), capacity=3)  # type: ignore[arg-type]
    bodies = [Body(str(number), engine.claim(), terms()) for number in range(3)]
    rotations = motion(3)
    headless = ALL.copy()
    headless[2] = False
    engine.run([body.plan(0, 0.0, Pose(rotations[0], ALL)) for body in bodies])
    before = {name: state[1].copy() for name, state in engine.slots.states.items()}
    outcomes = engine.run(
        [body.plan(1, 0.04, Pose(rotations[1], headless if body.name == "1" else ALL)) for body in bodies]
    )
    assert isinstance(outcomes[1], EngineError)
    assert all(isinstance(outcomes[at], Outcome) for at in (0, 2))
    assert all(np.array_equal(engine.slots.states[name][1], state) for name, state in before.items())


def test_a_run_that_fails_at_a_second_step_undoes_the_first():
    class FailingOnce(Failing):
        calls = 0

        def run(self, *arguments):
            self.calls += 1
            if self.calls == self.fails_at:
                raise EngineError("once")
            return model().run(*arguments)

        fails_at = 0

    def outcomes(fails_at):
        runtime = FailingOnce()
        engine = Engine(runtime, capacity=3)  # type: ignore[arg-type]
        bodies = [Body(str(number), engine.claim(), terms()) for number in range(3)]
        rotations = motion(4)
        for seq in range(3):
            engine.run([body.plan(seq, seq / 30, Pose(rotations[seq], ALL)) for body in bodies])
        runtime.fails_at = runtime.calls + fails_at
        last = [3 / 30, 5 / 30, 4 / 30]  # one step, three, two
        tickets = [body.plan(3, time, Pose(rotations[3], ALL)) for body, time in zip(bodies, last, strict=True)]
        assert [len(ticket.steps) for ticket in tickets] == [1, 3, 2]
        return intensities(engine.run(tickets))

    assert outcomes(2) == outcomes(3) == outcomes(0)


def test_a_model_that_gives_nan_is_told(monkeypatch):
    class Poisoned(Failing):
        def run(self, *arguments):
            outputs = model().run(*arguments)
            outputs.intensity[:] = np.nan
            return outputs

    engine = Engine(Poisoned(), capacity=1)  # type: ignore[arg-type]
    (outcome,) = engine.run([Body("a", engine.claim(), terms()).plan(0, 0.0, Pose(motion(1)[0], ALL))])
    assert isinstance(outcome, EngineError)


def test_a_gap_held_runs_masked_steps():
    seen = []

    class Spying(Failing):
        def run(self, rotations, mask, emotion, states):
            seen.append(mask[0, 0].copy())
            return Model.run(model(), rotations, mask, emotion, states)

    engine = Engine(Spying(), capacity=1)  # type: ignore[arg-type]
    body = Body("a", engine.claim(), terms())
    rotations = motion(2)
    engine.run([body.plan(0, 0.0, Pose(rotations[0], ALL))])
    engine.run([body.plan(1, 0.5, Pose(rotations[1], ALL))])
    assert [mask.all() for mask in seen] == [True, *[False] * 14, True]


def test_window_is_the_model_on_the_last_four_seconds():
    rotations = motion(200)
    engine = Engine(model(), capacity=2)
    windowed = plan(Body("a", engine.claim(), terms(memory="window")), rotations, rate=30)
    beside = plan(Body("b", engine.claim(), terms()), rotations, rate=30)
    outcomes = [engine.run(pair) for pair in zip(windowed, beside, strict=True)]
    for at in (0, 1, 50, 119, 120, 150, 199):
        expected = whole_sequence(rotations[max(at - 119, 0) : at + 1])[-1]
        assert outcomes[at][0].intensity == expected
    assert intensities(pair[1] for pair in outcomes) == whole_sequence(rotations).tolist()
