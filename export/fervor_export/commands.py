"""`fervor train` and `fervor export`: entry points of the group `fervor.commands`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from fervor_export.clip import Clip
    from fervor_export.recipe import Recipe
    from fervor_export.training import TrainingResult


def train(  # noqa: PLR0917  # typer calls it by name
    data: Annotated[str, typer.Option(help="Data set: a folder, a manifest, or `synthetic`.")] = "synthetic",
    recipe: Annotated[Literal["default", "paper"], typer.Option(help="How to learn.")] = "default",
    seed: Annotated[int, typer.Option(help="Of data, weights, order and augmentation.")] = 0,
    clips: Annotated[int, typer.Option(min=20, help="How many clips to synthesise, for `synthetic`.")] = 12000,
    epochs: Annotated[int | None, typer.Option(min=1, help="Instead of the recipe's.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Stop after the epoch that reaches this.")] = None,
    threads: Annotated[int, typer.Option(min=1, help="Of torch; more help only where cores are idle.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Run directory.", show_default="runs/<data>-<recipe>-<seed>")] = None,
) -> None:
    """Train a network; leaves checkpoint, model file, model card and figures in a run directory."""
    from dataclasses import replace

    import torch

    from fervor_export.data.augment import augment
    from fervor_export.data.progress import loading_bar
    from fervor_export.material import gather
    from fervor_export.recipe import PAPER, RECIPES
    from fervor_export.run import Run

    torch.set_num_threads(threads)
    chosen = RECIPES[recipe] if epochs is None else replace(RECIPES[recipe], epochs=epochs)
    with loading_bar() as told:
        material = gather(data, clips=clips, seed=seed, progress=told)
    learn = augment(material.learn) if chosen.name == PAPER.name else material.learn
    result = _train_visibly(learn, material.validate, chosen, seed=seed, minutes=minutes)
    run = Run(data=data, material=material, recipe=chosen, seed=seed, threads=threads, result=result)
    directory = out or Path("runs") / f"{Path(data).stem}-{recipe}-{seed}"
    trained = run.write(directory)
    best, scores = result.best, trained.scores
    typer.echo(
        f"{directory}: epoch {best.number} of {len(result.history)}; on other actors MAE {scores['test_mae']:.3f}, "
        f"r {scores['test_r']:.2f}, within emotion {scores['test_r_within']:.2f}"
    )


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


def _train_visibly(
    learn: "list[Clip]", validate: "list[Clip]", recipe: "Recipe", *, seed: int, minutes: float | None
) -> "TrainingResult":
    """Train with a progress bar and a line per epoch."""
    from rich.progress import Progress

    from fervor_export.training import Epoch
    from fervor_export.training import train as run_training

    with Progress() as progress:
        task = progress.add_task(f"{len(learn)} clips", total=recipe.epochs * len(learn))

        def show(epoch: Epoch) -> None:
            scores = epoch.validation
            progress.console.print(
                f"epoch {epoch.number:3}  train MAE {epoch.train_mae:.4f}  validation MAE {scores.mae:.4f}"
                f"  r {scores.r:.3f}  within {scores.r_within:.3f}  CCC {scores.ccc:.3f}  {epoch.seconds:.0f} s",
                highlight=False,
                soft_wrap=True,
            )

        return run_training(
            learn,
            validate,
            recipe,
            seed=seed,
            max_minutes=minutes,
            on_epoch=show,
            on_batch=lambda count: progress.advance(task, count),
        )
