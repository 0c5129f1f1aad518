"""The page of `fervor score --html`, gathered while file after file is scored."""

from pathlib import Path

from fervor.cli.picture.target import check_target, write
from fervor.cli.picture.trace import Trace
from fervor.cli.playing import Take
from fervor.cli.recordings import read
from fervor.protocol.messages import ModelInfo
from fervor.server.scoring_models import SequenceScore


class Album:
    """Draws recordings one by one and keeps the drawings only, so that many recordings fit.

    Args:
        path: HTML file to write.
        skeleton: of tables that don't name theirs.
        hysteresis: half-width of the band in which a level stays; None where the model did not say.
    """

    def __init__(self, path: Path, *, skeleton: str | None, hysteresis: float | None) -> None:
        check_target(path, ".html", option="--html")
        self._path = path
        self._skeleton = skeleton
        self._hysteresis = hysteresis
        self._sections: list[str] = []

    def add(self, scored: SequenceScore, file: Path, model: ModelInfo) -> None:
        """Draw a file that was scored with all its estimates."""
        from fervor.cli.picture.page import section

        take = Take.of(read(file, skeleton=self._skeleton))
        estimates = scored.estimates or ()
        trace = Trace(scored.name, model, estimates, take.times, take.poses, self._hysteresis)
        self._sections.append(section(trace, len(self._sections) + 1))

    def write(self, model: ModelInfo) -> None:
        """Write the page.

        Raises:
            CannotWrite: it can't be written.
        """
        from fervor.cli.picture.page import page

        write(self._path, page(model, self._sections).encode())
