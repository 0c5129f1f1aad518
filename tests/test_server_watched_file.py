"""A file that changes is read anew; one that breaks changes nothing, and is complained of without its content."""

import logging
import os
from pathlib import Path

import pytest

from fervor.errors import InputError
from fervor.server.watched_file import LOOK_EVERY_S, WatchedFile, lines_of
from fervor.settings import SettingsError


class Clock:
    """Time that passes when told to."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def words(text: str) -> list[str]:
    if "broken" in text:
        raise InputError("is broken")
    return text.split()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "words").write_text("a b", encoding="utf-8")
    return tmp_path / "words"


@pytest.fixture
def clock() -> Clock:
    return Clock()


def replace(path: Path, content: str) -> None:
    """As Kubernetes and careful people do it: whole, at once."""
    fresh = path.with_suffix(".new")
    fresh.write_text(content, encoding="utf-8")
    fresh.rename(path)


def test_it_is_read_anew_when_it_changed_but_not_at_every_call(path: Path, clock: Clock) -> None:
    file = WatchedFile(path, words, clock=clock)
    replace(path, "c")
    clock.now += LOOK_EVERY_S / 2
    assert file.current() == ["a", "b"]
    clock.now += LOOK_EVERY_S / 2
    assert file.current() == ["c"]


def test_a_file_that_stays_is_not_read_again(path: Path, clock: Clock) -> None:
    read: list[str] = []
    file = WatchedFile(path, read.append, clock=clock)
    for _ in range(5):
        clock.now += LOOK_EVERY_S
        file.current()
    assert len(read) == 1


def test_a_change_of_the_same_size_within_a_second_is_seen(path: Path, clock: Clock) -> None:
    file = WatchedFile(path, words, clock=clock)
    seen = path.stat()
    replace(path, "x y")
    os.utime(path, ns=(seen.st_atime_ns, seen.st_mtime_ns))
    clock.now += LOOK_EVERY_S
    assert file.current() == ["x", "y"]


@pytest.mark.parametrize("how", ["broken", "gone", "no text"])
def test_what_breaks_keeps_the_old_and_says_so_once(
    how: str, path: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    file = WatchedFile(path, words, clock=clock)
    if how == "broken":
        replace(path, "broken secret")
    elif how == "gone":
        path.unlink()
    else:
        path.write_bytes(b"\xff\xfe\xff")
    with caplog.at_level(logging.INFO):
        for _ in range(3):
            clock.now += LOOK_EVERY_S
            assert file.current() == ["a", "b"]
        (record,) = caplog.records
        assert record.levelname == "ERROR"
        assert str(path) in record.message
        assert "what it said before stays in force" in record.message
        assert "secret" not in caplog.text
        replace(path, "well again")
        clock.now += LOOK_EVERY_S
        assert file.current() == ["well", "again"]
        assert "changed and was read anew" in caplog.text


def test_at_the_start_it_must_be_in_order(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="can't be read: No such file"):
        WatchedFile(tmp_path / "nothing", words)
    (tmp_path / "words").write_text("broken", encoding="utf-8")
    with pytest.raises(SettingsError, match="words is broken"):
        WatchedFile(tmp_path / "words", words)


def test_lines_have_comments_and_gaps() -> None:
    assert lines_of("# all\n\n  a b # c\n\td\n") == [(3, ["a", "b"]), (4, ["d"])]
