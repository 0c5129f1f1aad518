"""Loading: in order, from the cache where it can be, by several processes, and never stopped by a bad file."""

from pathlib import Path

import numpy as np
import pytest

import datasets
from fervor_export.data import loading
from fervor_export.data.cache import Ask
from fervor_export.data.loading import load_motions
from fervor_export.data.motion import Motion


@pytest.fixture
def asked(tmp_path: Path) -> list[Ask]:
    """Files of different lengths, one of them broken, one of them absent."""
    asked = [
        Ask(datasets.write_npz(tmp_path / f"{index}.npz", datasets.motion(seconds=0.6 + index / 10, seed=index)))
        for index in range(4)
    ]
    asked[1].file.write_text("broken")
    asked[2].file.unlink()
    return asked


def lengths(answers: list[Motion | str]) -> list[int | None]:
    return [answer.poses if isinstance(answer, Motion) else None for answer in answers]


def test_answers_are_in_order_and_say_what_is_wrong(asked: list[Ask]) -> None:
    answers = load_motions(asked, cache=None)
    assert lengths(answers) == [72, None, None, 108]
    assert "not an NPZ file" in str(answers[1])
    assert "can't be read" in str(answers[2])


@pytest.mark.parametrize("kept", [False, True])
def test_every_file_is_told(asked: list[Ask], tmp_path: Path, kept: bool) -> None:
    if kept:
        load_motions(asked, cache=tmp_path / "cache")
    told: list[tuple[int, int]] = []
    load_motions(asked, cache=tmp_path / "cache", progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (4, 4)
    assert told == sorted(told)


def test_what_was_kept_is_not_read_again(asked: list[Ask], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = load_motions(asked, cache=tmp_path / "cache")
    read: list[Path] = []

    def refuse(file: Path, **_: object) -> Motion:
        read.append(file)
        raise OSError("must not be read")

    monkeypatch.setattr(loading, "read_motion", refuse)
    again = load_motions(asked, cache=tmp_path / "cache")
    assert lengths(again) == lengths(first)
    assert read == [asked[1].file, asked[2].file]
    datasets.write_npz(asked[0].file, datasets.motion(seconds=0.7, seed=9))
    load_motions(asked, cache=tmp_path / "cache")
    assert asked[0].file in read


def test_several_processes_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = [
        Ask(datasets.write_npz(tmp_path / f"{index}.npz", datasets.motion(seconds=0.6, seed=index, rate_hz=60.0)))
        for index in range(12)
    ]
    asked[7].file.write_text("broken")
    alone = load_motions(asked, cache=None, processes=1)
    monkeypatch.setattr(loading, "FEW", 2)
    monkeypatch.setattr(loading, "TOGETHER", 2)
    together = load_motions(asked, cache=tmp_path / "cache", processes=2)
    assert lengths(together) == lengths(alone)
    for one, other in zip(alone, together, strict=True):
        if isinstance(one, Motion) and isinstance(other, Motion):
            np.testing.assert_array_equal(one.phases[0].rotations, other.phases[0].rotations)
        else:
            assert one == other
    assert len(list((tmp_path / "cache").rglob("*.npz"))) == 11
