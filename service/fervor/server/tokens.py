"""The bearer tokens that a service knows, each with the name of the client that holds it.

They come from the settings, where they have no names, and from a file that may change: a line holds `NAME TOKEN` or
just `TOKEN`. Two lines of one name are two tokens of one client: so a token is replaced without keeping the client out.
"""

import hashlib
import hmac
from collections.abc import Iterable
from dataclasses import dataclass

from fervor.errors import AuthError, InputError
from fervor.server.watched_file import WatchedFile, lines_of
from fervor.settings import Settings

UNNAMED = "-"
"""What logs call a client whose token has no name."""


@dataclass(frozen=True, slots=True)
class Token:
    """One token. Only its digest is kept: secrets of any length then take the same time to compare."""

    digest: bytes
    name: str

    @classmethod
    def of(cls, secret: str, name: str = UNNAMED) -> "Token":
        """The token for a secret."""
        return cls(_digest(secret.encode()), name)


class Tokens:
    """Who may in."""

    def __init__(self, fixed: Iterable[Token] = (), file: WatchedFile[tuple[Token, ...]] | None = None) -> None:
        self._fixed = tuple(fixed)
        self._file = file

    @classmethod
    def from_settings(cls, settings: Settings) -> "Tokens":
        """The tokens of a service.

        Raises:
            SettingsError: the file can't be used.
        """
        fixed = [Token.of(token.get_secret_value()) for token in settings.tokens]
        path = settings.tokens_file
        return cls(fixed, None if path is None else WatchedFile(path, parse_tokens))

    @classmethod
    def of_watchers(cls, settings: Settings, clients: "Tokens") -> "Tokens":
        """The tokens of those who watch the live page: their own, or else those of clients."""
        own = [Token.of(token.get_secret_value()) for token in settings.page_tokens]
        return cls(own) if own else clients

    @property
    def known(self) -> bool:
        """Whether there is any, so that not everybody may in."""
        return bool(self._fixed) or self._file is not None

    def holder(self, shown: Iterable[bytes]) -> str | None:
        """The name of the client that shows these tokens; None where everybody may in.

        Raises:
            AuthError: there are tokens, and none of them was shown.
        """
        known = self._fixed + (() if self._file is None else self._file.current())
        if not known:
            return None
        guesses = [_digest(guess) for guess in shown]
        # Every pair is compared, so that the time taken says nothing of how near a guess was.
        names = [token.name for token in known for guess in guesses if hmac.compare_digest(token.digest, guess)]
        if not names:
            raise AuthError("this service needs a token that it knows; expected Authorization: Bearer with it")
        return names[0]


def parse_tokens(text: str) -> tuple[Token, ...]:
    """The tokens in the text of a file.

    Raises:
        InputError: a line of another form, or no token at all, which would let everybody in.
    """
    tokens = []
    for number, words in lines_of(text):
        if len(words) > 2:
            raise InputError(f"has {len(words)} words in line {number}; expected a token, or a name and a token")
        tokens.append(Token.of(words[-1], words[0] if len(words) == 2 else UNNAMED))
    if not tokens:
        raise InputError("has no token; expected one a line")
    return tuple(tokens)


def _digest(secret: bytes) -> bytes:
    return hashlib.sha256(secret).digest()
