"""Results for people: sheets on a terminal, and as Markdown."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console, Group
from rich.table import Table

from fervor_bench.results import Results
from fervor_bench.sheets import Sheet, remarks, sheets


def show(console: Console, results: Results) -> None:
    """Print everything."""
    console.print(results.machine.sentence, highlight=False, soft_wrap=True)
    if results.machine.interruptions:
        console.print(results.machine.interruptions.sentence, highlight=False, soft_wrap=True)
    console.print(Group(*map(as_table, sheets(results))))
    for sentence in remarks(results):
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)


def as_table(sheet: Sheet) -> Table:
    """A sheet for a terminal."""
    table = Table(title=sheet.title, title_justify="left")
    for number, heading in enumerate(sheet.headings):
        table.add_column(heading, justify="right" if number else "left", no_wrap=not number)
    for row in sheet.rows:
        table.add_row(*row)
    return table


def write_markdown(results: Results, path: Path) -> None:
    """Write everything as a page."""
    path.write_text("\n".join(_lines(results)) + "\n", encoding="utf-8")


def _lines(results: Results) -> Iterator[str]:
    yield from ("# Results of `fervor bench`", "", f"{results.made}. {results.machine.sentence}.")
    if results.machine.interruptions:
        yield from ("", f"{results.machine.interruptions.sentence}.")
    for sheet in sheets(results):
        yield from ("", f"## {sheet.title[0].upper()}{sheet.title[1:]}", "")
        yield _row(sheet.headings)
        yield "|" + "---|" * len(sheet.headings)
        yield from map(_row, sheet.rows)
    told = list(remarks(results))
    if told:
        yield from ("", "## Remarks", "", *(f"- {sentence}" for sentence in told))


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
