"""From a trained network to a model file, which is left on disk only if it computes what the network does."""

import platform
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np
import onnx
import torch

import fervor
from fervor.errors import ModelFileError
from fervor.metadata import ModelMetadata
from fervor.model import Model
from fervor.skeletons.rig import JOINTS, PARENTS
from fervor_export.checkpoint import TrainedNetwork
from fervor_export.graph import build_model
from fervor_export.network import Network
from fervor_export.parity import ParityReport, check_parity


def export_model(network: Network, metadata: ModelMetadata, path: Path) -> ParityReport:
    """Write a network as a model file, checked by the service's own loader and against torch.

    Raises:
        ModelFileError: metadata and network differ, or the file's results differ from the network's by more than
            `parity` allows; then `path` is as it was.
    """
    _check_contract(network, metadata)
    content = build_model(network, metadata).SerializeToString(deterministic=True)
    report = check_parity(network, Model.load(content))
    if not report.agrees:
        raise ModelFileError(
            f"{path} was not written: results would differ from the network's by {report.largest:.2g} "
            f"({report.where}); allowed is {report.allowed:.2g}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + ".part")
    draft.write_bytes(content)
    draft.replace(path)
    return report


def describe(
    trained: TrainedNetwork, *, name: str, version: str, purpose: Literal["demo", "research"]
) -> ModelMetadata:
    """What a trained network's model file says of itself."""
    config = trained.network.config
    return ModelMetadata(
        name=name,
        version=version,
        purpose=purpose,
        joints=JOINTS,
        parents=PARENTS,
        rate_hz=config.rate_hz,
        features=config.features,
        states=config.states,
        levels=trained.levels,
        training=trained.training,
        scores=trained.scores,
        libraries=library_versions(),
    )


def _check_contract(network: Network, metadata: ModelMetadata) -> None:
    """What the metadata promises of the graph must be what the network does."""
    config = network.config
    for what, promised, actual in (
        ("feature set", metadata.features, config.features),
        ("rate", metadata.rate_hz, config.rate_hz),
        ("states", metadata.states, config.states),
    ):
        if promised != actual:
            raise ModelFileError(f"the metadata says {what} {promised}, but the network has {actual}")


def library_versions() -> dict[str, str]:
    """Versions of what makes a model file."""
    return {
        "fervor": fervor.__version__,
        "numpy": np.__version__,
        "onnx": onnx.__version__,
        "onnxruntime": version("onnxruntime"),
        "python": platform.python_version(),
        "torch": torch.__version__,
    }
