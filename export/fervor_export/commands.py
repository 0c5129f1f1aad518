"""`fervor train` and `fervor export`: entry points of the group `fervor.commands`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from fervor_export.run import Run


def train(  # noqa: PLR0917  # typer calls it by name
    data: Annotated[str, typer.Option(help="Data set: a folder, a manifest, or `synthetic`.")] = "synthetic",
    recipe: Annotated[Literal["default", "paper"], typer.Option(help="How to learn.")] = "default",
    seed: Annotated[int, typer.Option(help="Of data, weights, order and augmentation.")] = 0,
    clips: Annotated[int, typer.Option(min=20, help="How many clips to synthesise, for `synthetic`.")] = 12000,
    epochs: Annotated[int | None, typer.Option(min=1, help="Instead of the recipe's.")] = None,
    folds: Annotated[
        int | None,
        typer.Option(min=2, help="Judge by so many folds of actors, then learn from all.", show_default="some actors"),
    ] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Stop after the epoch that reaches this.")] = None,
    threads: Annotated[int, typer.Option(min=1, help="Of torch; more help only where cores are idle.")] = 1,
    restart: Annotated[
        bool, typer.Option("--restart", help="Begin anew what lies half done in the directory.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Run directory.", show_default="runs/<data>-<recipe>-<seed>")] = None,
) -> None:
    """Train a network; leaves checkpoint, model file, model card and figures in a run directory.

    Killed and typed again, it goes on after the last epoch that was done.
    """
    from dataclasses import replace

    import torch

    from fervor_export.recipe import RECIPES
    from fervor_export.run import STATE
    from fervor_export.train_run import Order, train_run

    torch.set_num_threads(threads)
    chosen = RECIPES[recipe] if epochs is None else replace(RECIPES[recipe], epochs=epochs)
    directory = out or Path("runs") / f"{Path(data).stem}-{recipe}-{seed}"
    if restart:
        (directory / STATE).unlink(missing_ok=True)
    order = Order(
        data=data, recipe=chosen, seed=seed, clips=clips, folds=folds, minutes=minutes, threads=threads
    )  # fmt: skip
    run = train_run(order, directory)
    run.write(directory)
    typer.echo(in_short(run, directory))


def export(  # noqa: PLR0917  # typer calls it by name
    checkpoint: Annotated[Path, typer.Argument(help="checkpoint.pt of a run; with --triton, a model file too.")],
    out: Annotated[Path, typer.Option(help="Model file to write.")] = Path("model.onnx"),
    name: Annotated[str, typer.Option(help="What the service will call it.")] = "fervor-demo",
    version: Annotated[str, typer.Option(help="Of the model, as you count.")] = "0.1.0",
    purpose: Annotated[
        Literal["demo", "research"] | None,
        typer.Option(help="Shown wherever the model shows.", show_default="the checkpoint's"),
    ] = None,
    triton: Annotated[Path | None, typer.Option(help="Add it to this model repository of Triton too.")] = None,
) -> None:
    """Write the model file of a checkpoint, checked against the network it comes from."""
    if triton is not None and checkpoint.suffix == ".onnx":
        _add_to_repository(checkpoint, triton)
        return
    from fervor_export.checkpoint import load_checkpoint
    from fervor_export.export import describe, export_model

    trained = load_checkpoint(checkpoint)
    metadata = describe(trained, name=name, version=version, purpose=purpose or trained.purpose)
    report = export_model(trained.network, metadata, out)
    typer.echo(f"{out}: {name} {version}, largest difference to the network {report.largest:.1e} ({report.where})")
    if triton is not None:
        _add_to_repository(out, triton)


def _add_to_repository(model_file: Path, repository: Path) -> None:
    from fervor_export.triton import write_repository

    typer.echo(f"{write_repository(model_file, repository)}: a version for Triton")


def in_short(run: "Run", directory: Path) -> str:
    """One line of a finished run."""
    scores, result = run.judgement.scores, run.result
    prefix = next((part for part in ("test_", "actors_", "recordings_", "given_") if part + "mae" in scores), "")
    way = "on held-out clips" if prefix == "test_" else "out of fold"
    told = ", ".join(
        f"{title} {scores[prefix + name]:.2f}"
        for name, title in (("mae", "MAE"), ("r", "r"), ("r_within", "within emotion"))
        if prefix + name in scores
    )
    return f"{directory}: epoch {result.kept.number} of {len(result.history)}; {way} {told or 'nothing is defined'}"
