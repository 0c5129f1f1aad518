"""The picture of `fervor stream --plot`: what was streamed up to its end, however it ended."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Self

import numpy as np

from fervor.cli.picture.rule import hysteresis_at
from fervor.cli.picture.target import check_target, write
from fervor.cli.picture.trace import Trace
from fervor.cli.playing import TimedPose
from fervor.cli.screens import Screen, say
from fervor.errors import FervorError
from fervor.protocol.messages import Estimate, ModelInfo
from fervor_client.address import STREAM_PATH, stream_url

MOST_S = 600.0
"""A picture shows no more than the newest so many seconds: a loop may go on for days."""


class Plot:
    """Watches a stream of one body, between `with` and its end, and then draws it.

    Args:
        path: PNG or SVG file to write.
        name: of the recording.
    """

    def __init__(self, path: Path, name: str) -> None:
        check_target(path, ".png", ".svg", option="--plot")
        self._path = path
        self._name = name
        self._hysteresis: float | None = None
        self._model: ModelInfo | None = None
        self._estimates: deque[Estimate] = deque()
        self._frames: deque[TimedPose] = deque()

    def __enter__(self) -> Self:
        """Load what draws, so that the end of a stream has not to wait for it."""
        import fervor.cli.picture.figure  # noqa: F401

        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        """Draw what came, whether the stream ended, was interrupted or was lost.

        Raises:
            CannotWrite: the file can't be written.
        """
        from fervor.cli.picture.figure import image

        if self._model is None or not self._estimates:
            if kind is None or not issubclass(kind, FervorError):  # that one says itself what is wrong
                say(f"no estimate came, so {self._path} was not drawn")
            return
        times, poses = zip(*self._frames, strict=True)
        estimates = tuple(self._estimates)
        trace = Trace(self._name, self._model, estimates, np.asarray(times), np.asarray(poses), self._hysteresis)
        write(self._path, image(trace, self._path.suffix.lower().removeprefix(".")))
        say(f"{self._path} shows what was streamed")

    def ask_for_rule(self, url: str, token: str | None) -> None:
        """Learn from the service of a stream how wide the band is in which a level stays; the stream does not say it.

        Raises:
            InputError: `url` is not the address of a stream.
        """
        base = stream_url(url).replace("ws", "http", 1).removesuffix(STREAM_PATH)
        self._hysteresis = hysteresis_at(base, token)

    def watch(self, frames: Iterable[TimedPose]) -> Iterator[TimedPose]:
        """The same frames, remembered."""
        for time, pose in frames:
            self._frames.append((time, pose))
            while time - self._frames[0][0] > MOST_S:
                self._frames.popleft()
            yield time, pose

    def beside(self, screen: Screen, model: ModelInfo) -> Screen:
        """A screen that shows what `screen` shows, and remembers the estimates."""
        self._model = model
        return _Beside(screen, self._remember)

    def _remember(self, estimate: Estimate) -> None:
        self._estimates.append(estimate)
        while estimate.t - self._estimates[0].t > MOST_S:
            self._estimates.popleft()


class _Beside:
    """A screen with somebody beside it who takes down what it shows."""

    def __init__(self, screen: Screen, remember: Callable[[Estimate], None]) -> None:
        self._screen = screen
        self._remember = remember

    def __enter__(self) -> Self:
        self._screen.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._screen.__exit__(*error)

    def show(self, estimate: Estimate) -> None:
        self._remember(estimate)
        self._screen.show(estimate)
