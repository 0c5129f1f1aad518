"""The keys and the clock that checkpoints are signed with."""

import secrets
import time
from collections.abc import Callable

from fervor.errors import InputError
from fervor.server.watched_file import WatchedFile, lines_of
from fervor.session.sealing import Sealer
from fervor.settings import SHORTEST_KEY, Settings


def seal_and_open(settings: Settings) -> tuple[Callable[[bytes], str], Callable[[str], bytes]]:
    """What a session signs and opens checkpoints with.

    Without keys in the settings one is made up: streams then survive a cut connection, but not this process.

    Raises:
        SettingsError: the file of keys can't be used.
    """
    sealer = _sealer(settings)
    return lambda content: sealer().seal(content, time.time()), lambda token: sealer().open(token, time.time())


def _sealer(settings: Settings) -> Callable[[], Sealer]:
    """Gives the keys that are in force."""
    ttl_s = settings.checkpoint_ttl_s
    if settings.checkpoint_keys_file is not None:
        return WatchedFile(settings.checkpoint_keys_file, lambda text: Sealer(parse_keys(text), ttl_s)).current
    keys = [key.get_secret_value().encode() for key in settings.checkpoint_keys]
    if not keys:
        keys = [secrets.token_bytes(32)]
    sealer = Sealer(keys, ttl_s)
    return lambda: sealer


def parse_keys(text: str) -> tuple[bytes, ...]:
    """The keys in the text of a file: one a line, the first signs.

    Raises:
        InputError: a line of another form, a short key, or none at all.
    """
    keys = []
    for number, words in lines_of(text):
        if len(words) != 1 or len(words[0]) < SHORTEST_KEY:
            raise InputError(f"has no key in line {number}; expected one word of {SHORTEST_KEY} characters or more")
        keys.append(words[0].encode())
    if not keys:
        raise InputError("has no key; expected one a line")
    return tuple(keys)
