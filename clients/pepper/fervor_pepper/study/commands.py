"""`fervor study`: an entry point of the group `fervor.commands`.

`fervor study FOLDER` analyses; `add` and `template` are commands of their own, so a folder of such a name is `./add`.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from fervor.errors import DataError, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from fervor_pepper.study.result import StudyResult
    from fervor_pepper.study.sessions import Doings

ANALYSE = "analyse"


class _Group(TyperGroup):
    """Takes what names no command for the folder to analyse."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, "--help"):
            args = [ANALYSE, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(no_args_is_help=True, cls=_Group, help="Field tests: questionnaires on 7-point scales, analysed.")


@app.callback()
def _study() -> None:
    """Field tests: questionnaires on 7-point scales, analysed.

    `fervor study FOLDER` is short for `fervor study analyse FOLDER`.
    """


@app.command(ANALYSE)
def analyse(
    folder: Annotated[
        Path, typer.Argument(help="Of the study: answers.csv, and session logs if you like.", show_default=False)
    ],
    *,
    as_json: Annotated[bool, typer.Option("--json", help="JSON instead of tables.")] = False,
    html: Annotated[Path | None, typer.Option(help="Write the report here too, with plots.")] = None,
) -> None:
    """Compare the conditions: repeated-measures ANOVA and Bonferroni-corrected pairs, per scale."""
    from rich.console import Console

    from fervor_pepper.study.analysis import analyse as compare_all
    from fervor_pepper.study.answers import read_answers
    from fervor_pepper.study.report import to_html, to_json
    from fervor_pepper.study.sessions import read_sessions

    answers, odd = read_answers(folder)
    result, doings = compare_all(answers, odd), read_sessions(folder)
    if as_json:
        typer.echo(to_json(result, doings))
    else:
        _show(Console(), result, doings)
    if html is not None:
        try:
            html.write_text(to_html(result, doings, title=folder.resolve().name), encoding="utf-8")
        except OSError as error:
            raise DataError(f"{html}: can't be written: {error.strerror or error}") from None
    if not result.scales:
        raise typer.Exit(DataError.exit_code)


@app.command()
def add(
    folder: Annotated[Path, typer.Argument(help="Of the study.", show_default=False)],
    answers: Annotated[
        list[str], typer.Argument(help="SCALE=ANSWER or SCALE:ITEM=ANSWER, each from 1 to 7.", show_default=False)
    ],
    *,
    participant: Annotated[str, typer.Option(help="A code, never a name.", show_default=False)],
    condition: Annotated[str, typer.Option(help="The condition that is judged.", show_default=False)],
) -> None:
    """Add a participant's answers to the form; the last answer to a question counts."""
    from fervor_pepper.study.answers import Question, add_answers

    told = []
    for said in answers:
        place, equals, answer = said.rpartition("=")
        scale, _, item = place.partition(":")
        if not (equals and scale and answer.isdecimal()):
            raise InputError(f"{said!r} is no answer; expected SCALE=ANSWER or SCALE:ITEM=ANSWER, like likeable=5")
        told.append((Question(participant, condition, scale, item or "1"), int(answer)))
    typer.echo(f"{add_answers(folder, told)}: {len(told)} added")


@app.command()
def template(
    folder: Annotated[Path, typer.Argument(help="Of the study; made where there is none.", show_default=False)],
    *,
    participants: Annotated[int, typer.Option(min=1, help="How many; their codes are P01, P02, …")],
    condition: Annotated[list[str], typer.Option(help="A condition; say it once for each.", show_default=False)],
    scale: Annotated[
        list[str], typer.Option(help="A scale, SCALE or SCALE:ITEMS; say it once for each.", show_default=False)
    ],
) -> None:
    """Write an empty form to fill in; conditions come in an order that turns from participant to participant."""
    from fervor_pepper.study.answers import write_template

    scales = {}
    for said in scale:
        name, _, items = said.partition(":")
        if not name or not (items or "1").isdecimal() or int(items or "1") < 1:
            raise InputError(f"{said!r} is no scale; expected SCALE or SCALE:ITEMS, like likeable:5")
        scales[name] = int(items or "1")
    codes = [f"P{number:0{max(2, len(str(participants)))}d}" for number in range(1, participants + 1)]
    typer.echo(write_template(folder, codes, condition, scales))


def _show(console: "Console", result: "StudyResult", doings: "Sequence[Doings]") -> None:
    from rich.markup import escape

    from fervor_pepper.study import report

    for note in result.notes:
        console.print(escape(note), style="yellow")
    for scale in result.scales:
        console.print(f"\n[bold]{escape(scale.scale)}[/bold]  {escape(report.sentence(scale))}")
        console.print(escape(report.assumptions(scale)), style="dim")
        _table(console, report.CONDITION_HEAD, report.condition_cells(scale))
        _table(console, report.PAIR_HEAD, [report.pair_cells(pair) for pair in scale.pairs])
    if doings:
        console.print("\n[bold]What the robot did[/bold]")
        _table(console, report.SESSION_HEAD, report.session_cells(doings))


def _table(console: "Console", head: "Sequence[str]", rows: "Sequence[Sequence[str]]") -> None:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for number, name in enumerate(head):
        table.add_column(name, justify="right" if number else "left")
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)
