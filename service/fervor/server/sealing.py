"""The keys and the clock that checkpoints are signed with."""

import secrets
import time
from collections.abc import Callable

from fervor.session.sealing import Sealer
from fervor.settings import Settings


def seal_and_open(settings: Settings) -> tuple[Callable[[bytes], str], Callable[[str], bytes]]:
    """What a session signs and opens checkpoints with.

    Without keys in the settings one is made up: streams then survive a cut connection, but not this process.
    """
    keys = [key.get_secret_value().encode() for key in settings.checkpoint_keys]
    if not keys:
        keys = [secrets.token_bytes(32)]
    sealer = Sealer(keys, settings.checkpoint_ttl_s)
    return lambda content: sealer.seal(content, time.time()), lambda token: sealer.open(token, time.time())
