"""`fervor reproduce`: an entry point of the group `fervor.commands`."""

from pathlib import Path
from typing import Annotated, Literal

import typer


def reproduce(  # noqa: PLR0917  # typer calls it by name
    data: Annotated[str, typer.Argument(help="EBMDB's folder, a manifest or its folder, or `synthetic`.")],
    recipe: Annotated[Literal["default", "paper"], typer.Option(help="How to learn.")] = "paper",
    seed: Annotated[int, typer.Option(help="Of folds, weights, order and resampling.")] = 0,
    folds: Annotated[int, typer.Option(min=2, help="Of the protocol by recording.")] = 5,
    epochs: Annotated[int | None, typer.Option(min=1, help="Instead of the recipe's.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Of training, all trainings together.")] = None,
    clips: Annotated[int, typer.Option(min=20, help="How many clips to synthesise, for `synthetic`.")] = 1000,
    threads: Annotated[int, typer.Option(min=1, help="Of torch; more help only where cores are idle.")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="Folder for everything.", show_default="reproductions/<data>-<recipe>-<seed>")
    ] = None,
) -> None:
    """Do the paper's experiment: check the data, judge by folds, learn from everything; report and model file.

    Killed and typed again, it goes on after the last epoch that was done.
    """
    from dataclasses import replace

    import torch
    from rich.console import Console

    from fervor_export.commands import in_short
    from fervor_export.data.progress import loading_bar
    from fervor_export.data.report import print_report
    from fervor_export.evaluate_command import show
    from fervor_export.recipe import RECIPES
    from fervor_export.reproduce import Experiment, write_data_report
    from fervor_export.watching import watching

    torch.set_num_threads(threads)
    chosen = RECIPES[recipe] if epochs is None else replace(RECIPES[recipe], epochs=epochs)
    directory = out or Path("reproductions") / f"{Path(data).stem}-{recipe}-{seed}"
    experiment = Experiment(data, chosen, seed, folds, clips, minutes, threads)
    with loading_bar() as told:
        loaded, summary = experiment.load(told)
    print_report(Console(), loaded, summary)
    write_data_report(loaded, summary, directory)
    with watching(experiment.trainings(loaded), chosen.epochs) as watcher:
        judged = experiment.judge(loaded, directory, watcher)
        run = experiment.learn(loaded, judged, directory, watcher)
    show(judged)
    typer.echo(in_short(run, directory))
    typer.echo(f"{directory / 'evaluation.html'}, {directory / 'model.onnx'}")
