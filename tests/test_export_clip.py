"""Clips."""

from dataclasses import replace

import numpy as np
import pytest

from fervor.errors import DataError, InputError
from fervor_export.clip import digest
from networks import waving_clips


@pytest.fixture
def clip():
    return waving_clips(1)[0]


def test_length(clip):
    assert clip.frames == len(clip.rotations)
    assert clip.seconds == clip.frames / 30


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"rotations": np.zeros((0, 13, 4), np.float32)}, r"rotations \(0, 13, 4\)"),
        ({"rotations": np.zeros((5, 12, 4), np.float32)}, r"rotations \(5, 12, 4\)"),
        ({"mask": np.ones((3, 13), np.bool_)}, r"a mask \(3, 13\)"),
        ({"intensity": 1.5}, "the intensity 1.5"),
        ({"intensity": float("nan")}, "the intensity nan"),
    ],
)
def test_what_is_no_clip(clip, changes, told):
    with pytest.raises(DataError, match=f"clip 'clip0' has {told}"):
        replace(clip, **changes)


def test_unknown_emotions(clip):
    with pytest.raises(InputError, match="emotion 'hunger' is not known"):
        replace(clip, emotion="hunger")


def test_the_digest_is_of_everything(clip):
    other = waving_clips(2)[1]
    digests = [
        digest(clips)
        for clips in (
            [clip],
            [clip, other],
            [other, clip],
            [replace(clip, intensity=clip.intensity / 2)],
            [replace(clip, emotion="joy")],
            [replace(clip, mask=~clip.mask)],
            [replace(clip, rotations=-clip.rotations)],
        )
    ]
    assert len(set(digests)) == len(digests)
    assert digest([clip]) == digest(waving_clips(1))
