"""`fervor evaluate`: an entry point of the group `fervor.commands`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from rich.progress import Progress

    from fervor_export.evaluation.estimator import Estimator, Reading
    from fervor_export.evaluation.evaluate import Evaluated, Material, Options, Watch
    from fervor_export.evaluation.held_out import LearnedFrom
    from fervor_export.recipe import Recipe
    from fervor_export.training import Epoch

SYNTHETIC = "synthetic"


def evaluate(  # noqa: PLR0917  # typer calls it by name
    data: Annotated[str, typer.Option(help="Data set: a folder, a manifest, or `synthetic`.")] = SYNTHETIC,
    recipe: Annotated[Literal["default", "paper"], typer.Option(help="How to learn.")] = "default",
    checkpoint: Annotated[
        str | None,
        typer.Option(help="Judge this model by clips new to it: a run directory, a model file, or `default`."),
    ] = None,
    folds: Annotated[int, typer.Option(min=2, help="Of the protocol by recording.")] = 5,
    seed: Annotated[int, typer.Option(help="Of folds, training and resampling.")] = 0,
    minutes: Annotated[float | None, typer.Option(min=0, help="Of training, all folds together.")] = None,
    epochs: Annotated[int | None, typer.Option(min=1, help="Instead of the recipe's.")] = None,
    clips: Annotated[int, typer.Option(min=20, help="How many clips to synthesise, for `synthetic`.")] = 1000,
    threads: Annotated[int, typer.Option(min=1, help="Of torch.")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the report.", show_default="evaluations/<data>-<model>-<seed>")
    ] = None,
) -> None:
    """Evaluate a recipe by folds, or a model by clips new to it; leaves a report as HTML, JSON and CSV."""
    from dataclasses import replace

    import torch

    from fervor_export.evaluation.evaluate import Options
    from fervor_export.evaluation.report import write
    from fervor_export.recipe import RECIPES

    torch.set_num_threads(threads)
    chosen = RECIPES[recipe] if epochs is None else replace(RECIPES[recipe], epochs=epochs)
    options = Options(folds=folds, seed=seed, minutes=minutes)
    evaluated = _evaluate_visibly(data, clips, chosen, checkpoint, options)
    what = recipe if checkpoint is None else Path(checkpoint).stem
    directory = out or Path("evaluations") / f"{Path(data).stem}-{what}-{seed}"
    write(evaluated, directory)
    show(evaluated)
    typer.echo(f"{directory / 'evaluation.html'}")


def _evaluate_visibly(
    data: str, clips: int, recipe: "Recipe", checkpoint: str | None, options: "Options"
) -> "Evaluated":
    """Load and evaluate with progress bars."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from fervor_export.evaluation.evaluate import evaluate as run_evaluation

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, transient=True) as progress:
        material = _load(data, clips, options.seed, progress)
        if checkpoint is not None:
            return _judge(checkpoint, material, options, _watch(progress, None))
        return run_evaluation(material, recipe, options=options, watch=_watch(progress, recipe))


def _load(data: str, clips: int, seed: int, progress: "Progress") -> "Material":
    """The data set; generated motion is labelled by panels, so that it has a noise ceiling as real data have."""
    from fervor_export.data.dataset import load_dataset
    from fervor_export.evaluation.evaluate import Material

    task = progress.add_task(f"loading {data}", total=None)
    loaded = load_dataset(
        data,
        progress=lambda done, total: progress.update(task, completed=done, total=total),
        clips=clips,
        seed=seed,
        votes=True,
    )
    progress.remove_task(task)
    return Material.of(loaded)


def _watch(progress: "Progress", recipe: "Recipe | None") -> "Watch":
    """Bars for the trainings, and for the epochs of the one under way."""
    from fervor_export.evaluation.evaluate import Watch

    whole = progress.add_task("evaluation", total=None)
    inside = None if recipe is None else progress.add_task("epoch", total=recipe.epochs)

    def stage(what: str, done: int, total: int) -> None:
        progress.update(whole, description=what, completed=done, total=total or None)
        if inside is not None:
            progress.reset(inside, description="epoch")

    def epoch(done: "Epoch") -> None:
        if inside is not None:
            scores = done.validation
            described = "epoch" if scores is None else f"epoch, validation r within {scores.r_within:.2f}"
            progress.update(inside, completed=done.number, description=described)

    return Watch(stage, epoch)


def _judge(which: str, material: "Material", options: "Options", watch: "Watch") -> "Evaluated":
    """Judge a model by the clips that are new to it."""
    from dataclasses import replace

    from fervor_export.evaluation.evaluate import evaluate_model
    from fervor_export.evaluation.held_out import held_out

    estimator, reading, name, demo, learned = _model(which)
    kept = held_out(material.clips, learned, demo=demo, procedural=material.procedural)
    source = f"{material.source}; {len(kept)} of {len(material.clips)} clips are new to the model"
    return evaluate_model(
        estimator, replace(material, clips=kept, source=source), reading, model=name, options=options, watch=watch
    )


def _model(which: str) -> "tuple[Estimator, Reading, str, bool, LearnedFrom | None]":
    """A model by its run directory, its checkpoint, its file or as `default`: with its name, whether it is a demo, and
    what it learned from."""  # noqa: D205, D209
    from fervor.model import Model, default_model_path
    from fervor_export.checkpoint import load_checkpoint
    from fervor_export.evaluation.estimator import ModelEstimator, NetworkEstimator, Reading
    from fervor_export.evaluation.held_out import read_learned_from
    from fervor_export.recipe import DEFAULT, RECIPES

    path = default_model_path() if which == "default" else Path(which)
    path = path / "checkpoint.pt" if path.is_dir() else path
    learned = read_learned_from(path.parent)
    if path.suffix == ".onnx":
        model = Model.load(path)
        metadata = model.metadata
        name = f"{metadata.name} {metadata.version}"
        return ModelEstimator(model), Reading.of(DEFAULT), name, metadata.purpose == "demo", learned
    trained = load_checkpoint(path)
    reading = Reading.of(RECIPES.get(trained.recipe, DEFAULT))
    return NetworkEstimator(trained.network), reading, str(path), trained.purpose == "demo", learned


def show(evaluated: "Evaluated") -> None:
    """The numbers on the terminal, warnings first."""
    from rich.console import Console

    from fervor_export.evaluation.terminal import print_evaluation

    print_evaluation(Console(), evaluated.result)
