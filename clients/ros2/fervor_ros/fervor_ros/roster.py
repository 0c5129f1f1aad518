"""Which bodies there are. One that is missing from the list is gone after a while only: trackers flicker."""

from collections.abc import Iterable

from fervor_ros.pose import Stamp


class Roster:
    """The tracked bodies, by a clock that callers bring."""

    def __init__(self, fixed: Iterable[str], grace_ns: int) -> None:
        """`fixed`: bodies that are always there; `grace_ns`: how long a body may be missing."""
        self._fixed = frozenset(fixed)
        self._grace_ns = grace_ns
        self._missing: dict[str, Stamp | None] = dict.fromkeys(self._fixed)
        """Bodies, and since when they are missing."""

    @property
    def bodies(self) -> frozenset[str]:
        """Those there are."""
        return frozenset(self._missing)

    def listed(self, ids: Iterable[str], now: Stamp) -> None:
        """These bodies are tracked, and no others."""
        tracked = {body for body in ids if body} | self._fixed
        for body in self._missing.keys() - tracked:
            if self._missing[body] is None:
                self._missing[body] = now
        self._missing.update(dict.fromkeys(tracked))

    def sweep(self, now: Stamp) -> frozenset[str]:
        """The bodies that are gone by now; asked once."""
        gone = frozenset(
            body
            for body, since in self._missing.items()
            # A clock that was set back says nothing on how long they are missing.
            if since is not None and not 0 <= now - since < self._grace_ns
        )
        for body in gone:
            del self._missing[body]
        return gone
