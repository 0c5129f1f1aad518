"""A file of secrets that may change while the service runs: read anew when it did, at most looked at once a second.

A file that is gone or broken changes nothing: what was read before stays in force, and the log says so, once.
"""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from fervor.errors import InputError
from fervor.settings import SettingsError

log = logging.getLogger(__name__)

LOOK_EVERY_S = 1.0
"""Seconds between two looks at a file."""

Content = TypeVar("Content")

_Mark = tuple[int, int, int] | None
"""Inode, size and time of change (ns) of a file; None where it can't be seen."""


class WatchedFile(Generic[Content]):
    """What a file says, as of a second ago."""

    def __init__(
        self, path: Path, parse: Callable[[str], Content], *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Read the file for the first time.

        Args:
            path: of the file; Kubernetes and others replace it whole.
            parse: makes something of its text; raises InputError, without a secret in its sentence.
            clock: seconds.

        Raises:
            SettingsError: the file can't be read or used.
        """
        self._path = path
        self._parse = parse
        self._clock = clock
        self._looked = clock()
        self._mark = self._look()
        try:
            self._content = self._read()
        except InputError as error:
            raise SettingsError(error.message) from None

    def current(self) -> Content:
        """What the file says, or said when it was last in order."""
        now = self._clock()
        if now - self._looked >= LOOK_EVERY_S:
            self._looked = now
            if (mark := self._look()) != self._mark:
                self._mark = mark
                self._take()
        return self._content

    def _take(self) -> None:
        try:
            self._content = self._read()
        except InputError as error:
            log.error("%s; what it said before stays in force", error.message)  # noqa: TRY400  # a sentence is enough
        else:
            log.info("%s changed and was read anew", self._path)

    def _read(self) -> Content:
        try:
            text = self._path.read_text(encoding="utf-8")
        except OSError as error:
            raise InputError(f"{self._path} can't be read: {error.strerror}") from None
        except UnicodeDecodeError:
            raise InputError(f"{self._path} is not text; expected UTF-8") from None
        try:
            return self._parse(text)
        except InputError as error:
            raise InputError(f"{self._path} {error.message}") from None

    def _look(self) -> _Mark:
        try:
            seen = self._path.stat()
        except OSError:
            return None
        return seen.st_ino, seen.st_size, seen.st_mtime_ns


def lines_of(text: str) -> list[tuple[int, list[str]]]:
    """Number and words of each line that says something; `#` begins a comment."""
    split = ((number, line.partition("#")[0].split()) for number, line in enumerate(text.splitlines(), 1))
    return [(number, words) for number, words in split if words]
