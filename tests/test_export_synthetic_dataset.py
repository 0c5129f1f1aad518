"""The data set: deterministic, well-formed, and not a speedometer."""

from collections import Counter

import numpy as np
import pytest

from fervor import rotations
from fervor.emotions import EMOTIONS
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.synthetic import synthesise_dataset
from fervor_export.synthetic.dataset import PERSONS


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    return synthesise_dataset(clips=660, seed=5)


def test_the_same_seed_gives_the_same_clips_and_more_clips_begin_with_them(clips: list[Clip]) -> None:
    for first, again in zip(synthesise_dataset(clips=5, seed=5), clips, strict=False):
        assert np.array_equal(first.rotations, again.rotations)
        assert np.array_equal(first.mask, again.mask)
        assert (first.emotion, first.intensity, first.actor, first.name) == (
            again.emotion,
            again.intensity,
            again.actor,
            again.name,
        )
    assert not np.array_equal(synthesise_dataset(clips=1, seed=6)[0].rotations[:30], clips[0].rotations[:30])


def test_clips_are_well_formed(clips: list[Clip]) -> None:
    assert len({clip.name for clip in clips}) == len(clips)
    assert Counter(clip.emotion for clip in clips) == dict.fromkeys(EMOTIONS, 60)
    assert len({clip.actor for clip in clips}) == PERSONS
    for clip in clips:
        assert clip.rotations.dtype == np.float32
        assert 2.0 * RATE_HZ <= clip.frames <= 12.0 * RATE_HZ
        assert np.allclose(rotations.length(clip.rotations), 1.0, atol=1e-5)
        assert clip.mask[:, :9].mean() > 0.5
        assert clip.observers is None


def test_actors_of_another_seed_are_other_people(clips: list[Clip]) -> None:
    assert not {clip.actor for clip in synthesise_dataset(clips=20, seed=6)} & {clip.actor for clip in clips}


def test_intensities_cover_the_range_within_every_emotion(clips: list[Clip]) -> None:
    for emotion in EMOTIONS:
        intensity = np.array([clip.intensity for clip in clips if clip.emotion == emotion])
        assert intensity.std() > 0.18
        assert intensity.max() > 0.7
        assert intensity.min() < 0.25


def log_speed(clip: Clip) -> float:
    turned = rotations.angle_between(clip.rotations[1:, :9], clip.rotations[:-1, :9])
    return float(np.log(np.degrees(turned)[clip.mask[1:, :9]].mean()))


def test_speed_alone_is_not_the_label(clips: list[Clip]) -> None:
    speed, intensity = np.array([log_speed(clip) for clip in clips]), np.array([clip.intensity for clip in clips])
    assert abs(np.corrcoef(speed, intensity)[0, 1]) < 0.35
    within = {
        emotion: np.corrcoef(*(values[[clip.emotion == emotion for clip in clips]] for values in (speed, intensity)))[
            0, 1
        ]
        for emotion in ("anger", "sadness")
    }
    assert within["anger"] > 0.1 > -0.1 > within["sadness"]


def test_votes_are_shares_of_a_panel() -> None:
    expected, voted = synthesise_dataset(clips=60, seed=3), synthesise_dataset(clips=60, seed=3, votes=True)
    for truth, clip in zip(expected, voted, strict=True):
        assert clip.observers is not None
        assert np.isclose(clip.intensity * clip.observers, round(clip.intensity * clip.observers))
        assert np.array_equal(truth.rotations, clip.rotations)
    difference = np.array([clip.intensity - truth.intensity for clip, truth in zip(voted, expected, strict=True)])
    assert abs(difference.mean()) < 0.06
    assert 0.03 < difference.std() < 0.25
