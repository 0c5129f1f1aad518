"""Frames of a body that come together run as one sequence: to what they come to one after the other, to the bit."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import model, motion, terms
from fervor.engine.batcher import Batcher
from fervor.engine.engine import Engine
from fervor.engine.sequences import LONGEST, MOST_ROWS
from fervor.errors import EngineError
from fervor.model import Model, check_row_independence
from fervor.session.body import Body
from fervor.session.events import Outcome, Pose, Ticket
from fervor.session.lanes import LANES

AGE = 130
"""Frames after which both lanes of a body run, and none restarts soon."""

POSES = motion(64, seed=5)
MOTIONS = [motion(AGE, seed=seed) for seed in range(4)]


class Watching(Engine):
    """Notes how many tickets ran as sequences."""

    together = 0

    def run_sequences(self, bodies):
        outcomes = super().run_sequences(bodies)
        self.together += sum(map(len, bodies))
        return outcomes


def grown(engines: list[Engine], count: int, **agreed) -> list[Body]:
    """Bodies of some age, in the same slots of all engines."""
    bodies = []
    for number in range(count):
        slots = {engine.claim() for engine in engines}
        assert len(slots) == 1
        bodies.append(Body(str(number), slots.pop(), terms(**agreed)))
    for seq in range(AGE):
        batch = [
            body.plan(seq, seq / 30, Pose(MOTIONS[at % 4][seq], np.ones(13, np.bool_)))
            for at, body in enumerate(bodies)
        ]
        for engine in engines:
            engine.run(batch)
    return bodies


def follow(body: Body, steps: list[tuple[float, int, bool, str | None]]) -> list[Ticket]:
    """Its next frames: seconds since the one before, pose, whether joints are missing, a new label."""
    tickets = []
    for number, (seconds, pose, holes, emotion) in enumerate(steps):
        observed = np.ones(13, np.bool_)
        if holes:
            observed[pose % 13] = observed[(3 * pose) % 13] = False
        last = number == len(steps) - 1
        assert body.last is not None
        tickets.append(
            body.plan(body.newest_seq + 1, body.last + seconds, Pose(POSES[pose], observed), emotion=emotion, keep=last)
        )
    return tickets


def bits(outcome: Outcome | EngineError) -> tuple:
    assert isinstance(outcome, Outcome)
    memory = (
        None if outcome.memory is None else {name: array.tobytes() for name, array in outcome.memory.arrays.items()}
    )
    return outcome.intensity, outcome.by_emotion.tobytes(), outcome.seen, outcome.jumped, memory


def held(engine: Engine, slot: int) -> dict[str, bytes]:
    return {name: array.tobytes() for name, array in engine.slots.recall(slot).arrays.items()}


FRAMES = st.lists(
    st.tuples(
        st.sampled_from([1 / 30, 1 / 30, 0.03, 0.037, 0.005, 0.2, 0.4, 1.5]),
        st.integers(0, 63),
        st.sampled_from([False, False, True]),
        st.sampled_from([None, None, None, "anger", "joy"]),
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.lists(FRAMES, min_size=3, max_size=3), min_size=1, max_size=4))
def test_frames_together_come_to_what_they_come_to_one_by_one(rounds):
    plain, together = Engine(model(), capacity=3), Watching(model(), capacity=3)
    bodies = grown([plain, together], 3, checkpoint_s=0.5)
    batcher = Batcher(together)
    for frames in rounds:
        work = [follow(body, steps) for body, steps in zip(bodies, frames, strict=True)]
        tickets = [ticket for each in zip(*(pad(own) for own in work), strict=True) for ticket in each if ticket]
        expected = [bits(plain.run([ticket])[0]) for ticket in tickets]
        assert list(map(bits, batcher.run(tickets))) == expected
        assert all(held(plain, body.slot) == held(together, body.slot) for body in bodies)


def pad(tickets: list[Ticket]) -> list[Ticket | None]:
    return [*tickets, *[None] * (8 - len(tickets))]


def usual(bodies: list[Body], count: int = 6) -> list[Ticket]:
    return [ticket for body in bodies for ticket in follow(body, [(1 / 30, at, False, None) for at in range(count)])]


def test_usual_frames_do_run_together():
    engine = Watching(model(), capacity=3)
    bodies = grown([engine], 3)
    assert len(Batcher(engine).run(usual(bodies))) == engine.together == 18


def test_a_crowd_beyond_one_call_changes_no_bit():
    count = MOST_ROWS // LANES + 3
    plain, together = Engine(model(), capacity=count), Watching(model(), capacity=count)
    tickets = usual(grown([plain, together], count), 3)
    assert list(map(bits, Batcher(together).run(tickets))) == [bits(plain.run([ticket])[0]) for ticket in tickets]
    assert together.together == 3 * count


def test_every_run_is_told_to_who_watches():
    engine = Watching(model(), capacity=60)
    batcher, sizes = Batcher(engine), []
    batcher.watch(lambda run: sizes.append(run.size))
    batcher.run(usual(grown([engine], 60)))
    assert sizes == [252, 108]


def unusual() -> dict[str, object]:
    """What makes a body's frames take the plain way, done to its tickets."""
    from msgspec.structs import replace as but

    noisy = replace(terms().source.skeleton, noisy=True)
    return {
        "fresh": lambda tickets: [but(tickets[0], fresh=True), *tickets[1:]],
        "lost": lambda tickets: [tickets[0], but(tickets[1], pose=None, steps=()), *tickets[2:]],
        "noisy": lambda tickets: [but(each, source=but(each.source, skeleton=noisy)) for each in tickets],
        "of another kind": lambda tickets: [but(tickets[0], source=but(tickets[0].source)), *tickets[1:]],
        "with a checkpoint in between": lambda tickets: [
            but(tickets[0], checkpoint=Body.bookkeeping(Body("0", 0, terms()), Body("0", 0, terms()).snapshot(0.0))),
            *tickets[1:],
        ],
        "without a step": lambda tickets: [but(each, steps=()) for each in tickets],
        "of many steps": lambda tickets: [but(each, steps=each.steps * LONGEST) for each in tickets],
        "where a lane restarts": lambda tickets: [
            but(each, steps=tuple(but(step, lanes=3) for step in each.steps)) for each in tickets
        ],
    }


@pytest.mark.parametrize("what", unusual())
def test_what_is_unusual_is_no_sequence(what):
    engine = Engine(model(), capacity=1)
    tickets = usual(grown([engine], 1), 3)
    assert engine.is_sequence(tickets)
    assert not engine.is_sequence(unusual()[what](tickets))
    assert not Engine(model(), capacity=1, row_multiple=2).is_sequence(tickets)


def test_a_failing_model_fails_the_frames_that_it_fails_on_and_no_others(monkeypatch):
    engine = Watching(model(), capacity=2)
    bodies = grown([engine], 2)
    tickets = usual(bodies, 3)
    calls: list[int] = []
    whole = Model.run

    def run(self, rotations, mask, emotion, states):
        calls.append(rotations.shape[1])
        if rotations.shape[1] > 1 or len(calls) == 2:
            raise EngineError("a sequence, or the first wave")
        return whole(self, rotations, mask, emotion, states)

    monkeypatch.setattr(Model, "run", run)
    outcomes = Batcher(engine).run(tickets)
    assert calls[0] == 3
    assert all(isinstance(outcome, Outcome) for outcome in outcomes)
    assert engine.together == 0


def test_a_fault_of_ours_costs_the_short_way_only(monkeypatch, caplog):
    engine = Engine(model(), capacity=2)
    tickets = usual(grown([engine], 2), 3)
    monkeypatch.setattr("fervor.engine.engine.run_sequences", lambda *_: 1 / 0)
    assert all(isinstance(outcome, Outcome) for outcome in Batcher(engine).run(tickets))
    assert "the frames of 2 bodies could not be run together" in caplog.text


def test_the_proof_at_start_up_covers_a_call():
    covered = {name: of.default for name, of in inspect.signature(check_row_independence).parameters.items()}
    assert covered["together"] >= MOST_ROWS
    assert covered["largest"] * covered["frames"] >= MOST_ROWS * LONGEST
