"""`fervor data`: commands about data sets, an entry point of the group `fervor.commands`."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Data sets to train on and to be judged by.")


@app.callback()
def _data() -> None:
    """Data sets to train on and to be judged by."""


@app.command()
def check(
    source: Annotated[
        str, typer.Argument(help="EBMDB's folder in either layout, a manifest CSV or its folder.", show_default=False)
    ],
    *,
    html: Annotated[Path | None, typer.Option(help="Write the report here too, with plots.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="JSON instead of tables.")] = False,
    cache: Annotated[
        Path | None, typer.Option(help="Folder of motions that were read before.", show_default="the user's")
    ] = None,
    processes: Annotated[
        int | None, typer.Option(min=1, help="Processes to read files with.", show_default="one a processor")
    ] = None,
) -> None:
    """Read a whole data set and tell what is in it and all that is wrong with it.

    Exit code 65 means that something can't be used.
    """
    import json
    from dataclasses import asdict

    from rich.console import Console

    from fervor.errors import DataError
    from fervor_export.data.dataset import SYNTHETIC, check_dataset, load_dataset
    from fervor_export.data.progress import loading_bar
    from fervor_export.data.report import html_report, print_report
    from fervor_export.data.summary import summarise

    with loading_bar() as told:
        if source == SYNTHETIC:
            data = load_dataset(source)
        else:
            data = check_dataset(source, cache=cache, processes=processes, progress=told)
    summary = summarise(data)
    if as_json:
        typer.echo(
            json.dumps(summary.as_dict() | {"findings": [asdict(finding) for finding in data.findings]}, indent=2)
        )
    else:
        print_report(Console(), data, summary)
    if html is not None:
        try:
            html.write_text(html_report(data, summary), encoding="utf-8")
        except OSError as error:
            raise DataError(f"{html}: can't be written: {error.strerror or error}") from error
    if data.unusable or not data.clips:
        raise typer.Exit(DataError.exit_code)
