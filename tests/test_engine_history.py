"""A window keeps the newest poses and no more."""

import numpy as np

from fervor.engine.history import NO_HISTORY


def test_the_oldest_leave_first():
    history = NO_HISTORY
    for number in range(7):
        history = history.then(np.full((13, 4), number, np.float32), np.ones(13, np.float32), 3)
        assert len(history) == min(number + 1, 3)
    assert history.rotations[:, 0, 0].tolist() == [4.0, 5.0, 6.0]
    assert len(NO_HISTORY) == 0
