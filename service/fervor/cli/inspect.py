"""`fervor inspect`: what a model file is, what it needs and how good it is."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fervor.metadata import ModelMetadata
from fervor.model import Model, default_model_path
from fervor.server.model_info import describe_model


def inspect(
    model: Annotated[Path | None, typer.Argument(metavar="MODEL.onnx", help="Default: the model of fervor.")] = None,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, the same as GET /v1/model.")] = False,
) -> None:
    """Show what a model file promises: its contract, training data, scores and thresholds.

    The file is loaded and tried as the service would do it; exit code 65 means that the service would refuse it.
    """
    loaded = Model.load(model or default_model_path())
    if as_json:
        typer.echo(describe_model(loaded).model_dump_json(indent=2))
        return
    console = Console(highlight=False)
    console.print(_facts(loaded))
    console.print(_levels(loaded.metadata))


def _facts(model: Model) -> Table:
    metadata = model.metadata
    training = metadata.training
    table = Table(title=f"{metadata.name} {metadata.version}", show_header=False, title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    rows = {
        "purpose": "demo: it shows how fervor runs, not science" if metadata.purpose == "demo" else metadata.purpose,
        "poses": f"rig {metadata.rig}, {len(metadata.joints)} joints, {metadata.quaternion}, {metadata.rate_hz:g} Hz",
        "features": metadata.features,
        "states": ", ".join(f"{state.name} {list(state.shape)}" for state in metadata.states),
        "trained on": f"{training.description} ({training.recordings} recordings, {training.hours:.1f} h)",
        "training data": training.sha256,
        "scores": ", ".join(f"{name} {value:.3f}" for name, value in metadata.scores.items()) or "none",
        "license": metadata.license,
        "made with": ", ".join(f"{name} {version}" for name, version in metadata.libraries.items()) or "not said",
        "sha256": model.sha256,
        "fingerprint": f"{model.fingerprint} (on this machine)",
    }
    for name, value in rows.items():
        table.add_row(name, escape(value))
    return table


def _levels(metadata: ModelMetadata) -> Table:
    rule = metadata.levels
    table = Table(
        title="Levels",
        caption=f"strong from the threshold on; hysteresis ±{rule.hysteresis:g}, dwell {rule.dwell_s:g} s",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("emotion")
    table.add_column("threshold", justify="right")
    for emotion, threshold in rule.threshold.items():
        table.add_row(escape(emotion), f"{threshold:.3f}")
    return table
