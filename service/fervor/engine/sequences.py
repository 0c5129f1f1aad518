"""Bodies that bring several frames at once: the steps of each are a sequence, and one call of the model.

The plain way runs a body's tickets one after the other. Here the poses of all are adapted, and put on the grid,
together, and the model runs from each body's first step to its last. What comes of it is the same, to the bit: all but
the model is elementwise, and the model was checked for that at start-up (`fervor.model.check_row_independence`). Bodies
of which anything is unusual take the plain way.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.outcomes import outcomes_of
from fervor.engine.posing import Poses, adapt_all, hold
from fervor.engine.slots import Records, Slots
from fervor.engine.stepping import blend, emotions_at, poses_at, spoken
from fervor.model import Floats, Model
from fervor.session.events import Outcome, Step, Ticket
from fervor.session.lanes import LANES, LanePlan
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.rig import UPPER_BODY

MOST_ROWS = 40
"""Rows in one call: no more than what a model was checked for at its start."""

LONGEST = 32
"""Steps of a body in one call, likewise."""

Index = npt.NDArray[np.intp]


def is_sequence(tickets: Sequence[Ticket], plan: LanePlan) -> bool:
    """Whether tickets of one body, in their order, are as usual: poses of one kind, both lanes running throughout.

    A checkpoint may be asked for with the last one only: what the slot holds in between is nowhere.
    """
    source, places = tickets[0].source, [step.lanes for ticket in tickets for step in ticket.steps]
    if isinstance(source.skeleton, Landmarks) or source.skeleton.noisy or not 0 < len(places) <= LONGEST:
        return False
    for ticket in tickets:
        if ticket.fresh or ticket.pose is None or ticket.source is not source:
            return False
        if ticket.checkpoint is not None and ticket is not tickets[-1]:
            return False
    return plan.full.issuperset(places) and plan.restarting.isdisjoint(places)


def run_sequences(
    bodies: Sequence[Sequence[Ticket]], model: Model, slots: Slots, plan: LanePlan
) -> list[list[Outcome]]:
    """The outcomes of each body's tickets; all of their slots change, or none.

    Args:
        bodies: the tickets of each, in order; each `is_sequence`.
        model: what to run, whose rows are independent without padding.
        slots: what is kept of the bodies.
        plan: of the lanes, at the model's rate.

    Raises:
        EngineError: the model failed.
    """
    batch = _Batch.of(bodies)
    records = slots.read(batch.slots)
    came = adapt_all(batch.tickets, records["hinges"])  # of landmark sensors only, which are none of these
    poses = _chained(came.poses, batch, records)
    said = _run_all(batch, poses, model, slots, plan)
    told, last = batch.told(said, records["said"]), batch.last
    new = poses[1]
    seen = np.add.reduce(new.observed.take(UPPER_BODY, axis=1), axis=1)  # [ticket]
    records["pose"], records["observed"] = new.rotations[last], new.observed[last]
    records["said"], records["seen"] = told[last], seen[last]
    slots.write(batch.slots, records)
    return batch.by_body(outcomes_of(batch.tickets, told, seen, [0] * len(batch.tickets), slots))


def _run_all(
    batch: "_Batch", poses: tuple[Poses, Poses], model: Model, slots: Slots, plan: LanePlan
) -> npt.NDArray[np.float64]:
    """What is said at every step [step, k]; then the lanes are where the last ones left them."""
    steps, (old, new) = batch.steps, (each.rows(batch.whose) for each in poses)
    rotations, mask = poses_at(steps, old, new)
    inputs = _Inputs(rotations, mask, emotions_at(steps), plan.weight[[step.lanes for step in steps]])
    said = np.empty((len(steps), 1 + len(EMOTIONS)))
    after = []
    for bodies, rows in batch.calls():
        at = slots.lanes.take(batch.slots.take(bodies), axis=0).ravel()
        said[rows], states = _run(model, inputs, rows, slots.take(at))
        after.append((at, states))
    for at, states in after:  # not before all calls have gone well
        slots.put(at, states)
    return said


class _Inputs(NamedTuple):
    """What the model gets at every step, and what its lanes count for."""

    rotations: Floats  # [step, joint, 4]
    mask: Floats  # [step, joint]
    emotion: Floats  # [step, emotion]
    weight: npt.NDArray[np.float64]  # [step, lane]


def _run(
    model: Model, inputs: _Inputs, rows: Index, states: dict[str, Floats]
) -> tuple[npt.NDArray[np.float64], dict[str, Floats]]:
    """One call: what is said at steps [body, time], as [body, time, 1 + emotion], and the states after the last."""
    rotations, mask, emotion = (array[rows].repeat(LANES, axis=0) for array in inputs[:3])
    outputs = model.run(rotations, mask, emotion, states)
    said = spoken(outputs.intensity, outputs.intensity_by_emotion)  # [body · lane, time, k]
    by_lane = said.reshape(len(rows), LANES, rows.shape[1], -1).swapaxes(1, 2)
    return blend(by_lane, inputs.weight[rows]), outputs.states


class _Batch(NamedTuple):
    """Tickets of bodies, body by body, and their steps in the same order."""

    tickets: list[Ticket]
    slots: Index  # [body]
    first: Index  # [body] its first ticket
    last: Index  # [body] its last ticket
    steps: list[Step]
    whose: Index  # [step] ticket
    begin: Index  # [body] its first step
    counts: Index  # [body] steps
    ends: Index  # [ticket] the newest step when it is done; that of another body before, where there was none yet

    @classmethod
    def of(cls, bodies: Sequence[Sequence[Ticket]]) -> "_Batch":
        tickets = [ticket for body in bodies for ticket in body]
        sizes = np.array([len(body) for body in bodies])
        each = np.array([len(ticket.steps) for ticket in tickets])  # steps
        last = sizes.cumsum() - 1
        ends = each.cumsum() - 1
        counts = np.diff(ends[last] + 1, prepend=0)
        return cls(
            tickets=tickets,
            slots=np.array([body[0].slot for body in bodies], np.intp),
            first=last - sizes + 1,
            last=last,
            steps=[step for ticket in tickets for step in ticket.steps],
            whose=np.arange(len(tickets)).repeat(each),
            begin=ends[last] + 1 - counts,
            counts=counts,
            ends=ends,
        )

    def calls(self) -> list[tuple[Index, Index]]:
        """For each call of the model, its bodies, of as many steps each, and those steps [body, time]."""
        found = []
        for count in sorted(set(self.counts.tolist())):
            bodies = np.flatnonzero(self.counts == count)
            for start in range(0, len(bodies), MOST_ROWS // LANES):
                these = bodies[start : start + MOST_ROWS // LANES]
                found.append((these, self.begin[these, None] + np.arange(count)))
        return found

    def told(self, said: npt.NDArray[np.float64], before: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """What holds after each ticket [ticket, k], of what was said at each step and, by body, before all."""
        body = np.arange(len(self.slots)).repeat(self.last - self.first + 1)  # [ticket]
        none_yet = self.ends < self.begin[body]
        told = said[self.ends]
        told[none_yet] = before[body[none_yet]]
        return told

    def by_body(self, outcomes: list[Outcome]) -> list[list[Outcome]]:
        """The outcomes [ticket] of each body."""
        return [outcomes[first : last + 1] for first, last in zip(self.first.tolist(), self.last.tolist(), strict=True)]


def _chained(came: Poses, batch: _Batch, records: Records) -> tuple[Poses, Poses]:
    """The poses before every ticket and with it, holes held: each ticket's are the next one's before."""
    new = came
    if not came.observed.all():
        new = Poses(came.rotations.copy(), came.observed)
        before = Poses(records["pose"].copy(), records["observed"].copy())
        for place in range(int((batch.last - batch.first).max()) + 1):
            bodies = np.flatnonzero(batch.first + place <= batch.last)
            rows = batch.first[bodies] + place
            held = hold(came.rows(rows), before.rows(bodies))
            new.rotations[rows] = before.rotations[bodies] = held.rotations
    old = Poses(np.empty_like(new.rotations), np.empty_like(new.observed))
    old.rotations[1:], old.observed[1:] = new.rotations[:-1], new.observed[:-1]
    old.rotations[batch.first], old.observed[batch.first] = records["pose"], records["observed"]
    return old, new
