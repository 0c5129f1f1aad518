"""Copies of clips: mirrored, and of the other phases; whose they are is never lost."""

from pathlib import Path

import numpy as np

import datasets
from fervor.rotations import angle_between
from fervor.skeletons.rig import MIRROR
from fervor_export.clip import Clip, Phase, digest
from fervor_export.data.augment import augment
from fervor_export.data.motion import read_motion


def clip(tmp_path: Path, *, rate_hz: float = 120.0) -> tuple[Clip, datasets.Array]:
    rotations = datasets.motion(seconds=1.0, rate_hz=rate_hz)
    first, *others = read_motion(datasets.write_npz(tmp_path / "a.npz", rotations, rate_hz=rate_hz)).phases
    made = Clip(*first, "joy", 7 / 11, "Ann", "a", 11, phases=tuple(others))
    return made, rotations


def test_eight_copies_of_a_fast_recording(tmp_path: Path) -> None:
    original, rotations = clip(tmp_path)
    copies = augment([original])
    assert len(copies) == 8
    assert {(copy.name, copy.actor, copy.emotion, copy.intensity, copy.observers) for copy in copies} == {
        ("a", "Ann", "joy", 7 / 11, 11)
    }
    assert not any(copy.phases for copy in copies)
    for phase, copy in enumerate(copies[:4]):
        assert angle_between(copy.rotations.astype(float), rotations[phase::4][: copy.frames]).max() < 1e-5
    for plain, reflected in zip(copies[:4], copies[4:], strict=True):
        np.testing.assert_array_equal(reflected.rotations[..., 0], plain.rotations[:, list(MIRROR), 0])
        np.testing.assert_array_equal(reflected.rotations[..., 1], -plain.rotations[:, list(MIRROR), 1])


def test_only_what_is_asked_for_and_there(tmp_path: Path) -> None:
    original, _ = clip(tmp_path)
    for phases, count in ((1, 1), (2, 2), (4, 4), (9, 4)):
        assert len(augment([original], mirror=False, phases=phases)) == count
        assert len(augment([original], mirror=True, phases=phases)) == 2 * count
    slow, _ = clip(tmp_path, rate_hz=60.0)
    assert len(augment([slow])) == 4
    assert augment([]) == []


def test_the_clip_itself_is_the_first_copy_and_stays_as_it_is(tmp_path: Path) -> None:
    original, _ = clip(tmp_path)
    before = digest([original])
    assert digest(augment([original])[:1]) == before == digest([original])
    assert len(original.phases) == 3


def test_mirroring_swaps_what_was_seen(tmp_path: Path) -> None:
    original, _ = clip(tmp_path)
    mask = original.mask.copy()
    mask[:, 3] = False
    half = Clip(original.rotations, mask, "joy", 0.5, "Ann", "a", phases=(Phase(original.rotations, mask),))
    *plain, one, two = augment([half])
    assert len(plain) == 2
    for copy in (one, two):
        assert not copy.mask[:, 6].any()
        assert copy.mask[:, 3].all()
