"""Natural batching on a real event loop."""

import asyncio

import numpy as np

from bodies import model, motion, terms
from fervor.engine.batcher import Batcher
from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.session.body import Body
from fervor.session.events import Outcome, Pose

ALL = np.ones(13, np.bool_)


class Counting(Engine):
    """Remembers the size of every batch."""

    def __init__(self, capacity: int) -> None:
        super().__init__(model(), capacity=capacity)
        self.sizes: list[int] = []

    def run(self, tickets):
        self.sizes.append(len(tickets))
        return super().run(tickets)


def tickets(engine, count, *, frames=1):
    rotations = motion(frames)
    bodies = [Body(str(number), engine.claim(), terms()) for number in range(count)]
    return [body.plan(seq, seq / 30, Pose(rotations[seq], ALL)) for seq in range(frames) for body in bodies]


async def run_all(batcher, work):
    done: list[tuple] = []
    for ticket in work:
        batcher.submit(ticket, lambda ticket, outcome: done.append((ticket, outcome)))
    assert not done  # never from within submit
    while len(done) < len(work):
        await asyncio.sleep(0)
    return done


async def test_what_waits_goes_together_one_ticket_a_body():
    engine = Counting(4)
    done = await run_all(Batcher(engine), tickets(engine, 4, frames=3))
    assert engine.sizes == [4, 4, 4]
    assert [ticket.seq for ticket, _ in done if ticket.body == "2"] == [0, 1, 2]


async def test_a_lone_ticket_runs_in_the_next_turn_of_the_loop():
    engine = Counting(1)
    batcher = Batcher(engine)
    done = []
    batcher.submit(tickets(engine, 1)[0], lambda *answer: done.append(answer))
    assert batcher.depth == 1
    await asyncio.sleep(0)
    assert len(done) == 1


async def test_large_crowds_are_cut():
    engine = Counting(600)
    await run_all(Batcher(engine), tickets(engine, 600))
    assert engine.sizes == [256, 256, 88]


async def test_prompt_tickets_run_at_once_with_what_waits():
    engine = Counting(600)
    batcher, done = Batcher(engine), []
    work = tickets(engine, 600)
    for ticket in work[:3]:
        batcher.submit(ticket, lambda ticket, outcome: done.append(ticket.slot))
    outcomes = batcher.run(work[3:])
    assert len(outcomes) == 597
    assert done == [0, 1, 2]
    assert engine.sizes == [256, 256, 88]
    await asyncio.sleep(0)
    assert engine.sizes == [256, 256, 88]


async def test_prompt_tickets_of_one_slot_run_in_their_order():
    together, alone = Counting(3), Counting(3)
    outcomes = Batcher(together).run(tickets(together, 3, frames=4))
    expected = [alone.run([ticket])[0] for ticket in tickets(alone, 3, frames=4)]
    assert [outcome.intensity for outcome in outcomes] == [outcome.intensity for outcome in expected]
    assert together.sizes == [3, 3, 3, 3]


async def test_slots_with_more_tickets_wait_until_all_have_had_their_turn():
    engine = Counting(300)
    done = await run_all(Batcher(engine), tickets(engine, 300, frames=3))
    assert engine.sizes == [256, 256, 256, 132]
    slots = [ticket.slot for ticket, _ in done]
    assert all(sorted(slots[turn : turn + 300]) == list(range(300)) for turn in (0, 300, 600))
    for slot in (0, 150, 299):
        assert [ticket.seq for ticket, _ in done if ticket.slot == slot] == [0, 1, 2]


async def test_a_slot_is_released_only_after_its_last_ticket():
    engine = Counting(1)
    batcher = Batcher(engine)
    work = tickets(engine, 1, frames=3)
    done = []
    for ticket in work:
        batcher.submit(ticket, lambda *answer: done.append(answer))
    batcher.release(0)
    assert engine.slots.taken == 1
    while len(done) < 3:
        await asyncio.sleep(0)
    assert engine.slots.taken == 0


async def test_releasing_an_idle_slot_is_immediate():
    engine = Counting(1)
    engine.claim()
    Batcher(engine).release(0)
    assert engine.slots.taken == 0


async def test_a_session_that_fails_on_its_answer_costs_the_others_nothing(caplog):
    engine = Counting(3)
    batcher = Batcher(engine)
    done = []

    def deliver(ticket, outcome):
        if ticket.body == "0":
            raise RuntimeError("closed")
        done.append(outcome)

    for ticket in tickets(engine, 3):
        batcher.submit(ticket, deliver)
    await asyncio.sleep(0)
    assert len(done) == 2
    assert "a session failed on the outcome of frame 0 of body '0'" in caplog.text
    assert len(await run_all(batcher, tickets_again(engine))) == 1


def tickets_again(engine):
    return [Body("9", 1, terms()).plan(0, 0.0, Pose(motion(1)[0], ALL))]


async def test_a_broken_engine_answers_every_ticket_and_goes_on(caplog):
    class Broken(Counting):
        def run(self, tickets):
            if len(self.sizes) == 0:
                self.sizes.append(0)
                raise ZeroDivisionError
            return super().run(tickets)

    engine = Broken(2)
    batcher = Batcher(engine)
    answers = [outcome for _, outcome in await run_all(batcher, tickets(engine, 2))]
    assert all(isinstance(answer, EngineError) for answer in answers)
    assert isinstance((await run_all(batcher, tickets_again(engine)))[0][1], Outcome)
