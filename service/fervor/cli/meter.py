"""The live meter: the newest estimates of one body as something a terminal can show. A pure function of its fields.

    ╭─ joy.bvh ──────────────────────────────────────── 12.4 of 30.0 s ─╮
    │ joy         0.72  ━━━━━━━━━━━━━━━━━━━━━┿━━━━━━━━━────────  STRONG  │
    │                                   ▁▃▅▇█▇▅▃▁    ▁▂▃▄▅▆▇▇█▇         │
    │ last 10 s   ▁▁▂▂▃▄▅▆▇██▇▆▅▄▃▂▁▁▂▄▆██████████▇▆▆███████████        │
    │ status ok                                                         │
    ╰─ demo model fervor-demo 0.1.0: it shows how it runs, not science ─╯

`┿` is the threshold between weak and strong. Terminals without Unicode get ASCII.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderResult
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from fervor.levels import Level
from fervor.protocol.messages import Estimate, ModelInfo

SPAN_S = 10.0
"""Time that the sparkline shows."""

RECENT_S = 1.0
"""Time for which a flag stays in sight."""

UNREMARKABLE = frozenset({"between_steps", "interpolated"})
"""Flags of a sensor that is faster or slower than the model: nothing to look at."""

STYLES = {Level.STRONG: "bold magenta", Level.WEAK: "cyan", None: "dim"}

SPARKS = " ▁▂▃▄▅▆▇█"
SPARKS_ASCII = " .:-=+*%#"
SPARK_ROWS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Meter:
    """What the terminal shows, a rich renderable.

    Args:
        name: of the recording.
        model: that answers.
        estimates: of one body, oldest first, no more than the last `SPAN_S` are looked at.
        duration_s: of the recording; None where it is repeated.
    """

    name: str
    model: ModelInfo
    estimates: Sequence[Estimate] = ()
    duration_s: float | None = None

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The panel: nearly as wide as the terminal, for a terminal writes `^C` behind it; up to 100 columns."""
        width = min(options.max_width - 3, 100)
        wide = max(width - 29, 8)  # columns left for bar and sparkline
        grid = Table.grid(padding=(0, 1))
        grid.add_column(width=11, no_wrap=True)
        grid.add_column(width=4)
        grid.add_column(width=wide, no_wrap=True)
        grid.add_column(width=7, no_wrap=True)
        self._fill(grid, wide, ascii_only=options.ascii_only)
        title, subtitle = Text(self.name, "bold"), Text(describe(self.model), "yellow" if is_demo(self.model) else "")
        yield Panel(
            grid,
            title=Text.assemble(title, "  ", self._clock()),
            title_align="left",
            subtitle=subtitle,
            subtitle_align="left",
            width=width,
        )

    def _fill(self, grid: Table, wide: int, *, ascii_only: bool) -> None:
        now = self.estimates[-1] if self.estimates else None
        if now is None:
            grid.add_row("waiting", "", Text("for the first estimate", "dim"))
            return
        style = STYLES[now.level]
        shown = "  --" if now.intensity is None else f"{now.intensity:.2f}"
        mark = threshold(self.model, now.emotion)
        level = Text("no pose" if now.level is None else now.level.upper(), style)
        grid.add_row(
            now.emotion, Text(shown, style), bar(now.intensity, mark, wide, style, ascii_only=ascii_only), level
        )
        rows = sparkline(self.estimates, wide, rows=SPARK_ROWS, ascii_only=ascii_only)
        for place, row in enumerate(rows):
            label = Text(f"last {SPAN_S:g} s" if place == SPARK_ROWS - 1 else "", "dim")
            grid.add_row(label, "", Text(row, style), "")
        grid.add_row(Text("status", "dim"), "", Text(remarks(self.estimates), "" if now.status == "ok" else "yellow"))

    def _clock(self) -> Text:
        if not self.estimates:
            return Text("")
        at = f"{self.estimates[-1].t:.1f}"
        return Text(f"{at} s" if self.duration_s is None else f"{at} of {self.duration_s:.1f} s", "dim")


def is_demo(model: ModelInfo) -> bool:
    """Whether the model is there so that everything runs, not as science."""
    return model.purpose == "demo"


def describe(model: ModelInfo) -> str:
    """The model's name and version, and what a demo model is worth."""
    named = f"model {model.name} {model.version}"
    return f"demo {named}: shows how it runs, not science" if is_demo(model) else named


def threshold(model: ModelInfo, emotion: str) -> float:
    """From which intensity on an emotion counts as strong; 0.5 where the model does not say."""
    return model.thresholds.get(emotion, 0.5)


def bar(intensity: float | None, mark: float, width: int, style: str, *, ascii_only: bool = False) -> Text:
    """An intensity in [0, 1] as a bar of `width` columns with a mark at the threshold."""
    full, rest, cross = ("#", ".", "|") if ascii_only else ("━", "─", "┿")
    filled = round((intensity or 0.0) * width)
    at = min(int(mark * width), width - 1)
    text = Text(full * filled, style) + Text(rest * (width - filled), "dim")
    return text[:at] + Text(cross, "bold") + text[at + 1 :]


def sparkline(
    estimates: Sequence[Estimate], width: int, *, rows: int = 1, span_s: float = SPAN_S, ascii_only: bool = False
) -> list[str]:
    """The intensities of the last `span_s` seconds, newest at the right, as `rows` lines of `width` columns.

    A column is the highest intensity of its slice of time; slices are fixed in time, so that columns move but don't
    flicker. A column without an estimate is blank.
    """
    sparks = SPARKS_ASCII if ascii_only else SPARKS
    steps = len(sparks) - 1
    peaks = _peaks(estimates, width, span_s)
    lines = []
    for row in reversed(range(rows)):
        heights = [0 if peak is None else max(round(peak * rows * steps), 1) - row * steps for peak in peaks]
        lines.append("".join(sparks[min(max(height, 0), steps)] for height in heights))
    return lines


def remarks(estimates: Sequence[Estimate]) -> str:
    """The status of the newest estimate, and what happened to frames within the last second."""
    now = estimates[-1]
    recent = [estimate for estimate in estimates if now.t - estimate.t < RECENT_S]
    flags = dict.fromkeys(flag for estimate in recent for flag in estimate.flags if flag not in UNREMARKABLE)
    return ", ".join([now.status.replace("_", " "), *(flag.replace("_", " ") for flag in flags)])


def plain_line(estimate: Estimate, mark: float, *, width: int = 40) -> str:
    """An estimate as one line of plain text, for logs and pipes."""
    drawn = bar(estimate.intensity, mark, width, "", ascii_only=True).plain
    shown = " -- " if estimate.intensity is None else f"{estimate.intensity:.2f}"
    level = "" if estimate.level is None else str(estimate.level)
    words = f"{estimate.t:7.2f} s  {estimate.emotion:<9}  {shown}  [{drawn}]  {level:<6}  {remarks([estimate])}"
    return words.rstrip()


def _peaks(estimates: Sequence[Estimate], width: int, span_s: float) -> list[float | None]:
    """The highest intensity in each of `width` slices of the last `span_s` seconds, oldest first."""
    peaks: list[float | None] = [None] * width
    if not estimates:
        return peaks
    slice_s = span_s / width
    newest = int(estimates[-1].t // slice_s)
    for estimate in estimates:
        place = width - 1 - (newest - int(estimate.t // slice_s))
        if estimate.intensity is not None and 0 <= place < width:
            peaks[place] = max(peaks[place] or 0.0, estimate.intensity)
    return peaks
