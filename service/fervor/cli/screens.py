"""Where estimates are shown: a live meter for people, plain lines for logs, JSON for programs."""

import sys
import time
from collections import deque
from typing import Protocol, Self

from rich.console import Console
from rich.live import Live

from fervor.cli.meter import SPAN_S, Meter, describe, plain_line, threshold
from fervor.errors import FervorError
from fervor.protocol.codec import CODECS, JsonCodec
from fervor.protocol.messages import Estimate, ModelInfo

REFRESH_S = 1 / 15
"""Least time between two pictures of the live meter."""

EVERY_S = 0.5
"""Time between two plain lines, on the estimates' clock; a change of level is always told."""

COMPLAINTS = 3
"""Errors that are told one by one; those that follow are mostly the same."""


class Screen(Protocol):
    """Shows the estimates of one body as they come, between `with` and its end."""

    def __enter__(self) -> Self:
        """Begin."""

    def __exit__(self, *error: object) -> None:
        """End."""

    def show(self, estimate: Estimate) -> None:
        """Show one more estimate."""


class LiveScreen:
    """A meter that stands still and moves."""

    def __init__(self, name: str, model: ModelInfo, duration_s: float | None = None) -> None:
        self._meter = Meter(name, model, duration_s=duration_s)
        self._recent: deque[Estimate] = deque()
        self._live = Live(self._meter, console=Console(), auto_refresh=False)
        self._refreshed = -REFRESH_S

    def __enter__(self) -> Self:
        """Show an empty meter."""
        self._live.start(refresh=True)
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the last picture standing."""
        self._refresh()
        self._live.stop()

    def show(self, estimate: Estimate) -> None:
        """Take in an estimate, and show it unless the last picture is very new."""
        self._recent.append(estimate)
        while estimate.t - self._recent[0].t > SPAN_S:
            self._recent.popleft()
        if time.monotonic() - self._refreshed >= REFRESH_S:
            self._refresh()

    def _refresh(self) -> None:
        self._refreshed = time.monotonic()
        meter = self._meter
        self._live.update(Meter(meter.name, meter.model, tuple(self._recent), meter.duration_s), refresh=True)


class LineScreen:
    """Lines of plain text on standard output."""

    def __init__(self, name: str, model: ModelInfo) -> None:
        self._name = name
        self._model = model
        self._last: Estimate | None = None

    def __enter__(self) -> Self:
        """Say what is to come."""
        _write(f"{self._name}: {describe(self._model)}")
        return self

    def __exit__(self, *error: object) -> None:
        """Nothing is left to do."""

    def show(self, estimate: Estimate) -> None:
        """Write a line if the last is some time ago, or the level changed."""
        last = self._last
        if last is None or estimate.t - last.t >= EVERY_S or estimate.level != last.level:
            self._last = estimate
            _write(plain_line(estimate, threshold(self._model, estimate.emotion)))


class JsonScreen:
    """One line of JSON an estimate on standard output, as it came over the wire."""

    def __enter__(self) -> Self:
        """Nothing is to be said before."""
        return self

    def __exit__(self, *error: object) -> None:
        """Nothing is to be said after."""

    def show(self, estimate: Estimate) -> None:
        """Write the estimate."""
        _write(str(CODECS[JsonCodec.subprotocol].encode(estimate)))


class Complaints:
    """Tells recoverable errors on standard error: the first few."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, error: FervorError) -> None:
        """Tell one more."""
        self.count += 1
        if self.count <= COMPLAINTS:
            say(error.message)
        if self.count == COMPLAINTS:
            say("more errors like this are not shown")


def pick_screen(name: str, model: ModelInfo, *, duration_s: float | None, json: bool) -> Screen:
    """The screen that suits standard output."""
    if json:
        return JsonScreen()
    if sys.stdout.isatty() and not Console().is_dumb_terminal:
        return LiveScreen(name, model, duration_s)
    return LineScreen(name, model)


def say(sentence: str) -> None:
    """A word to the person at the terminal, beside the output."""
    sys.stderr.write(f"fervor: {sentence}\n")
    sys.stderr.flush()


def _write(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
