"""`fervor score`: whole motion files, here or by a running service, as a table, CSV or JSON.

A file that can't be used is told on standard error and costs no other file its score; the exit code says so at the end.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from fervor.cli.picture.album import Album
from fervor.cli.reports import Format, choose_format, show_table, write_report
from fervor.cli.scorers import Here, Remote
from fervor.emotions import emotion_vector
from fervor.errors import InputError
from fervor.protocol.messages import Clock, Memory
from fervor.server.scoring_models import Detail, FileOptions, ScoreResponse, SequenceScore


def score(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Motion files (BVH, MVNX, CSV, JSONL, NPZ).")],
    *,
    emotion: Annotated[str | None, typer.Option(help="The emotion meant, for all files; default: unknown.")] = None,
    skeleton: Annotated[
        str | None, typer.Option(help="Of tables that don't name theirs: a name, or a JSON file as calibrate writes.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON, the same as POST /v1/score/file.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Write CSV.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="With --json or --csv: every estimate.")] = False,
    out: Annotated[Path | None, typer.Option(help="Write to this file; its name may say .json or .csv.")] = None,
    html: Annotated[Path | None, typer.Option(help="Draw intensity and poses of each file on this HTML page.")] = None,
    memory: Annotated[Memory, typer.Option(help="How long the network remembers.")] = "staggered",
    clock: Annotated[Clock, typer.Option(help="`frames`: each frame is one step, whatever its time.")] = "time",
    model: Annotated[Path | None, typer.Option(help="Model file; default: the model of fervor.")] = None,
    url: Annotated[str | None, typer.Option(help="Have a running service do it: http://HOST:PORT.")] = None,
    token: Annotated[str | None, typer.Option(envvar="FERVOR_TOKEN", help="Token for that service.")] = None,
) -> None:
    """Score motion files: how intensely they show an emotion, by the estimates a live stream would get."""
    written = choose_format(as_json=as_json, as_csv=as_csv, out=out)
    if frames and written is Format.TABLE:
        raise typer.BadParameter("a table has no place for every frame; add --json or --csv", param_hint="--frames")
    if url and model:
        raise typer.BadParameter("the service at --url has a model of its own", param_hint="--model")
    emotion_vector(emotion)
    detail: Detail = "frames" if frames or html else "summary"
    options = FileOptions(clock=clock, memory=memory, detail=detail, emotion=emotion, skeleton=skeleton)
    scorer = Remote(url, options, token) if url else Here(model, options)
    album = Album(html, skeleton=skeleton, hysteresis=scorer.hysteresis) if html else None
    failures: list[InputError] = []
    scores = []
    for file, scored in _score_all(scorer, files, failures):
        if album:
            album.add(scored, file, scorer.model)
        scores.append(scored if frames else scored.model_copy(update={"estimates": None}))
    if album and scores:
        album.write(scorer.model)
    if scores:
        report = ScoreResponse(model=scorer.model, fingerprint=scorer.fingerprint, sequences=tuple(scores))
        if written is not Format.TABLE:
            write_report(report, written, out)
        if written is Format.TABLE or out:
            show_table(report)
    if failures:
        raise typer.Exit(failures[0].exit_code)


def _score_all(
    scorer: Here | Remote, files: list[Path], failures: list[InputError]
) -> Iterator[tuple[Path, SequenceScore]]:
    """Score file after file; one that can't be used is told and noted in `failures`."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=len(files))
        for file in files:
            progress.update(task, description=file.name)
            try:
                yield file, scorer.score(file)
            except InputError as error:
                failures.append(error)
                console.print(f"fervor: {error.message}", markup=False, highlight=False, soft_wrap=True)
            progress.advance(task)
