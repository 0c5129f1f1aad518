"""Agreement by seconds seen."""

import numpy as np

from fervor_export.evaluation.estimator import Reading
from fervor_export.evaluation.observed import by_seconds
from networks import waving_clips


def test_what_shows_later_is_agreed_with_later():
    clips = waving_clips(120)
    random = np.random.default_rng(0)
    estimates = []
    for clip in clips:
        values = np.full((clip.frames, 12), random.random(), np.float32)
        values[50:] = clip.intensity
        estimates.append(values)
    glances = by_seconds(clips, estimates, Reading(last=True))
    assert [glance.seconds for glance in glances] == [1, 2, 3, None]
    assert glances[0].r.value < 0.3
    assert glances[-1].r.value > 0.6
    assert [glance.whole for glance in glances] == sorted(glance.whole for glance in glances)
    assert (glances[0].whole, glances[-1].whole) == (0.0, 1.0)
    assert glances[-2].r == glances[-1].r
