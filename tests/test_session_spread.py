"""Checkpoints that fall on one instant are spread; one body alone never waits."""

import numpy as np

from bodies import motion, terms
from fervor.session.body import Body
from fervor.session.events import Outcome, Pose
from fervor.session.spread import FRAMES_EACH, LEAST, Spread

POSE = Pose(motion(1)[0], np.ones(13, np.bool_))
OUTCOME = Outcome(0.3, np.zeros(11), 9, 0)


def live(bodies: int, frames: int, *, start: float = 0.0) -> list[list[int]]:
    """Frames that brought a checkpoint, by body; all bodies send in one turn, 30 times a second."""
    spread = Spread()
    crowd = [Body(str(number), number, terms(checkpoint_s=1.0)) for number in range(bodies)]
    kept: list[list[int]] = [[] for _ in crowd]
    for seq in range(frames):
        spread.begin()
        for number, body in enumerate(crowd):
            spread.note()
            ticket = body.plan(seq, start + seq / 30, POSE, spread=spread)
            body.conclude(ticket, OUTCOME)
            if ticket.checkpoint is not None:
                kept[number].append(seq)
    return kept


def test_few_get_theirs_when_it_is_due() -> None:
    assert live(LEAST, 100) == [[0, 30, 60, 90]] * LEAST


def test_of_many_no_turn_has_more_than_its_share_and_nobody_is_left_out() -> None:
    bodies = 10 * FRAMES_EACH
    kept = live(bodies, 120)
    by_frame = np.bincount([seq for seqs in kept for seq in seqs], minlength=120)
    assert by_frame.max() <= LEAST + bodies // FRAMES_EACH
    assert all(len(seqs) >= 4 for seqs in kept)
    for seqs in kept:
        assert set(np.diff(seqs)[1:].tolist()) <= {29, 30, 31}  # one a second, at a part of it that is the body's own


def test_whoever_is_put_off_stays_where_he_was_put_whatever_the_clock() -> None:
    kept = live(20, 200, start=1_700_000_000.5)
    assert all(set(np.diff(seqs)[1:].tolist()) <= {29, 30, 31} for seqs in kept)
