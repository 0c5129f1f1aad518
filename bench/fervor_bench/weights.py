"""A model file's weights for the floor, in the order of `struct weights` in native/network.h."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnx
from onnx import numpy_helper

from fervor.emotions import EMOTIONS
from fervor.metadata import ModelMetadata
from fervor_bench.errors import BenchError

FEATURES = "rot6d+velocity"
HIDDEN = (64, 128)

VELOCITY_SCALE = 0.1
"""rad/s to feature; as fervor_export/features.py has it, which needs torch to import."""


def write_weights(model: Path, path: Path) -> None:
    """Write them.

    Raises:
        BenchError: the floor does not know this kind of network.
    """
    proto = onnx.load(str(model))
    metadata = ModelMetadata.from_props({entry.key: entry.value for entry in proto.metadata_props}, where=str(model))
    if metadata.features != FEATURES:
        raise BenchError(f"the floor knows networks with features {FEATURES}, but {model.name} has {metadata.features}")
    arrays = {tensor.name: numpy_helper.to_array(tensor) for tensor in proto.graph.initializer}
    parts = [np.array([2.0 * metadata.rate_hz * VELOCITY_SCALE])]
    for layer, hidden in enumerate(HIDDEN, start=1):
        w, r, b = (arrays[f"lstm{layer}.{part}"][0] for part in "WRB")
        if r.shape != (4 * hidden, hidden):
            raise BenchError(f"the floor knows LSTMs of {HIDDEN}, but {model.name} has {r.shape[1]} in layer {layer}")
        parts += [np.concatenate([w, r], axis=1).T, b[: 4 * hidden] + b[4 * hidden :]]
    logits = len(EMOTIONS) + 1
    parts += [arrays["head.weight"].T[:logits], arrays["head.bias"].reshape(-1)[:logits]]
    path.write_bytes(b"".join(_float32(part) for part in parts))


def _float32(array: npt.NDArray[np.floating]) -> bytes:
    return np.ascontiguousarray(array, "<f4").tobytes()
