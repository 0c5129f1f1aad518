"""Controls say what they are defined to say."""

from dataclasses import replace

import numpy as np
import pytest

from fervor.emotions import emotion_index
from fervor_export.evaluation.controls import (
    emotion_mean,
    mean_speed,
    mean_speed_by_emotion,
    other_emotions,
    speeds,
)
from fervor_export.evaluation.metrics import pearson
from networks import waving_clips


def test_the_mean_of_an_emotion_is_that_of_the_training_clips():
    clips = [replace(clip, emotion="joy") for clip in waving_clips(6)]
    other = replace(clips[0], emotion="anger", intensity=0.9)
    train = [*clips[:4], other]
    expected = np.mean([clip.intensity for clip in clips[:4]])
    strange = replace(clips[0], emotion="pride")
    everything = np.mean([clip.intensity for clip in train])
    assert emotion_mean(train, [clips[5], other, strange]) == pytest.approx([expected, 0.9, everything])


def test_speed_is_the_mean_angle_per_second():
    clip = waving_clips(1)[0]
    angle = 2 * np.arcsin(clip.rotations[:, 3, 0].astype(float))
    assert speeds([clip])[0] == pytest.approx(np.abs(np.diff(angle)).mean() * 30 * 6 / 9, rel=1e-4)
    assert speeds([replace(clip, mask=np.zeros_like(clip.mask))]) == [0.0]


def test_speed_predicts_what_speed_shows():
    clips = waving_clips(100)
    target = np.asarray([clip.intensity for clip in clips[60:]])
    assert pearson(mean_speed(clips[:60], clips[60:]), target) > 0.9
    fast_is_weak = [replace(clip, intensity=1 - clip.intensity) if clip.emotion < "g" else clip for clip in clips]
    target = np.asarray([clip.intensity for clip in fast_is_weak[60:]])
    plain = pearson(mean_speed(fast_is_weak[:60], fast_is_weak[60:]), target)
    own = pearson(mean_speed_by_emotion([*fast_is_weak[:60]] * 2, fast_is_weak[60:]), target)
    assert own > 0.7 > abs(plain)


def test_wrong_emotions_are_others_that_the_data_have():
    clips = waving_clips(50)
    wrong = other_emotions(clips, seed=0)
    assert all(label != emotion_index(clip.emotion) for label, clip in zip(wrong, clips, strict=True))
    assert other_emotions([clips[0]] * 3, seed=0) is None
