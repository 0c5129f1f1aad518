"""The web origins whose pages may use the service. A client without an origin is no browser, and not bound by them."""

from urllib.parse import urlsplit

from fervor.errors import OriginRefused

ANY = "*"

_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}


class Origins:
    """An allow-list, beside which a service's own pages may always use it."""

    def __init__(self, allowed: tuple[str, ...]) -> None:
        """Take the list; `*` in it stands for all."""
        self._any = ANY in allowed
        self._allowed = frozenset(allowed)

    def check(self, origin: str | None, host: str) -> None:
        """Let a request in, or not.

        Args:
            origin: what the browser says of the page; None where there is no browser.
            host: that the request was sent to, with its port if it names one.

        Raises:
            OriginRefused: a page of somewhere else.
        """
        if origin is None or self._any or origin.lower() in self._allowed or _is_of(origin, host):
            return
        shown = origin if len(origin) <= 100 else origin[:97] + "..."
        raise OriginRefused(f"pages of {shown!r} may not use this service; expected one of FERVOR_ORIGINS")


def _is_of(origin: str, host: str) -> bool:
    """Whether a page is of the very host that it calls; TLS may have ended before the service, so only ports count."""
    try:
        page = urlsplit(origin)
        called = urlsplit(f"{page.scheme}://{host}")
        usual = _PORTS.get(page.scheme)
        return bool(page.hostname) and (page.hostname, page.port or usual) == (called.hostname, called.port or usual)
    except ValueError:
        return False
