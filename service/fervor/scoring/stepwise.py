"""The plain way to score: frame by frame through body and engine, as a stream goes, takes side by side.

It scores everything, and says what the fast way (`fervor.scoring.sequences`) must equal to the bit.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.protocol.lean_estimate import LeanEstimate
from fervor.scoring.scored import Scored
from fervor.scoring.take import Take
from fervor.session.body import Body, Terms
from fervor.session.events import Pose, Ticket


def score_stepwise(
    engine: Engine, takes: Sequence[Take], terms: Terms, progress: Callable[[int], None]
) -> list[Scored]:
    """Score takes, at most as many as the engine has slots; nobody else may use it meanwhile.

    Raises:
        InputError: an emotion that is not known.
        EngineError: the model failed.
    """
    bodies = [  # the engine is ours alone, so a take's place is its slot
        Body(take.name, slot, replace(terms, source=take.source or terms.source), take.label(terms))
        for slot, take in enumerate(takes)
    ]
    answers: list[list[LeanEstimate]] = [[] for _ in takes]
    for frame in range(max((len(take) for take in takes), default=0)):
        batch = [(at, _plan(bodies[at], take, frame)) for at, take in enumerate(takes) if frame < len(take)]
        for (at, ticket), outcome in zip(batch, engine.run([ticket for _, ticket in batch]), strict=True):
            if isinstance(outcome, EngineError):
                raise outcome
            answers[at].append(bodies[at].conclude(ticket, outcome))
        progress(len(batch))
    return [Scored.of(take.name, estimates) for take, estimates in zip(takes, answers, strict=True)]


def _plan(body: Body, take: Take, frame: int) -> Ticket:
    pose = Pose(take.rotations[frame], take.observed[frame])
    return body.plan(frame, float(take.times[frame]), pose)
