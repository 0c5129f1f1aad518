"""The cache: what was kept comes back to the bit, and what changed is read anew."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import datasets
from fervor_export.data import cache
from fervor_export.data.cache import Ask, default_cache, load, save
from fervor_export.data.motion import Motion, read_motion


@pytest.fixture
def ask(tmp_path: Path) -> Ask:
    return Ask(datasets.write_bvh(tmp_path / "a.bvh", datasets.motion(seconds=0.8)))


def equal(a: Motion, b: Motion) -> bool:
    for field in dataclasses.fields(Motion):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if field.name == "phases":
            same = len(left) == len(right) and all(
                np.array_equal(x, y) and x.dtype == y.dtype
                for mine, other in zip(left, right, strict=True)
                for x, y in zip(mine, other, strict=True)
            )
        else:
            same = np.array_equal(left, right)
        if not same:
            return False
    return True


def test_a_motion_comes_back_to_the_bit(tmp_path: Path, ask: Ask) -> None:
    motion = read_motion(ask.file)
    save(tmp_path / "cache", ask.key(), motion)
    kept = load(tmp_path / "cache", ask.key())
    assert kept is not None
    assert equal(kept, motion)


def test_the_key_is_of_content_options_and_version(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = ask.file.with_name("b.bvh")
    copy.write_bytes(ask.file.read_bytes())
    keys = [ask.key()]
    assert Ask(copy).key() == keys[0]
    keys += [Ask(ask.file, start_s=0.1).key(), Ask(ask.file, end_s=0.1).key(), Ask(ask.file, skeleton="x").key()]
    ask.file.write_text(ask.file.read_text().replace("86.4", "86.5", 1))
    keys.append(ask.key())
    monkeypatch.setattr(cache, "LOADER_VERSION", cache.LOADER_VERSION + 1)
    keys.append(ask.key())
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04", b"no archive at all"])
def test_what_cannot_be_read_back_is_no_motion(tmp_path: Path, ask: Ask, damage: bytes) -> None:
    save(tmp_path, ask.key(), read_motion(ask.file))
    (kept,) = tmp_path.glob("v*/*.npz")
    kept.write_bytes(damage or kept.read_bytes()[:-200])
    assert load(tmp_path, ask.key()) is None
    np.savez(kept, frames=np.array([1]))
    assert load(tmp_path, ask.key()) is None


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path: Path, ask: Ask) -> None:
    (tmp_path / "file").touch()
    save(tmp_path / "file", ask.key(), read_motion(ask.file))
    assert load(tmp_path / "file", ask.key()) is None


def test_nothing_half_written_stays(tmp_path: Path, ask: Ask) -> None:
    save(tmp_path / "cache", ask.key(), read_motion(ask.file))
    assert [path.suffix for path in (tmp_path / "cache").rglob("*") if path.is_file()] == [".npz"]


def test_the_users_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_cache() == tmp_path / "fervor" / "motion"
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    assert default_cache() == Path.home() / ".cache" / "fervor" / "motion"
