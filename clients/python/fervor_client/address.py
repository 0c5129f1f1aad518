"""Where a service listens: the addresses people write, made complete."""

from urllib.parse import urlsplit, urlunsplit

from fervor.errors import InputError

STREAM_PATH = "/v1/stream"
"""Path of the WebSocket endpoint."""

DEFAULT_URL = f"ws://127.0.0.1:8080{STREAM_PATH}"
"""Where `fervor serve` listens unless told otherwise."""


def stream_url(url: str) -> str:
    """The WebSocket address that `url` means; one without a path gets `STREAM_PATH`.

    Raises:
        InputError: not a WebSocket address.
    """
    try:
        parts = urlsplit(url)
        usable = parts.scheme in ("ws", "wss") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is no number, half an IPv6 address
        usable = False
    if not usable or parts.fragment:
        raise InputError(f"{url!r} is not the address of a stream; expected one like {DEFAULT_URL}")
    return urlunsplit(parts._replace(path=STREAM_PATH)) if parts.path in ("", "/") else url


def without_secrets(url: str) -> str:
    """The address as it may stand in messages and logs: without user, password and query."""
    parts = urlsplit(url)
    return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2], query=""))
