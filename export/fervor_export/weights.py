"""A network's weights as the model file's initialisers, and back.

LSTM gates: ONNX stacks them i o f c, torch i f g o (c and g are the same one); they are paired by name.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnx
import torch
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from onnx import numpy_helper

from fervor.emotions import EMOTIONS
from fervor.errors import ModelFileError
from fervor.metadata import ModelMetadata
from fervor_export.network import Network, NetworkConfig

TORCH_GATES, ONNX_GATES = "ifgo", "iofg"
"""Order in which the four gates are stacked: input, forget, cell (g), output."""

_LSTM_NAMES = tuple(f"lstm{layer}.{part}" for layer in (1, 2) for part in "WRB")


def lstm_weights(lstm: torch.nn.LSTM) -> dict[str, npt.NDArray[np.float32]]:
    """The inputs W [1, 4h, in], R [1, 4h, h] and B [1, 8h] of the ONNX LSTM."""
    w, r, b_ih, b_hh = (
        _restack(lstm.get_parameter(name).detach().numpy(), TORCH_GATES, ONNX_GATES)
        for name in ("weight_ih_l0", "weight_hh_l0", "bias_ih_l0", "bias_hh_l0")
    )
    return {"W": w[None], "R": r[None], "B": np.concatenate([b_ih, b_hh])[None]}


def network_from_model_file(path: str | Path) -> Network:
    """The torch network of a model file that `graph.build_model` wrote, so that anybody can compare or train on.

    Raises:
        ModelFileError: the file is not such a model.
    """
    try:
        model = onnx.load(str(path))
    except (OSError, DecodeError) as error:
        raise ModelFileError(f"{path} can't be read as an ONNX file: {error}") from error
    metadata = ModelMetadata.from_props({entry.key: entry.value for entry in model.metadata_props}, where=str(path))
    arrays = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    missing = [name for name in (*_LSTM_NAMES, "head.weight", "head.bias") if name not in arrays]
    if missing:
        raise ModelFileError(f"{path} was not written by this exporter: it lacks the weights {', '.join(missing)}")
    columns, biases = (_head_tensor(arrays[name]) for name in ("head.weight", "head.bias"))
    config = NetworkConfig(
        features=metadata.features,
        head="additive" if bool((columns == columns[-1:]).all()) else "gated",
        rate_hz=metadata.rate_hz,
        hidden1=arrays["lstm1.R"].shape[-1],
        hidden2=arrays["lstm2.R"].shape[-1],
    )
    network = Network(config)
    for layer, lstm in ((1, network.lstm1), (2, network.lstm2)):
        lstm.load_state_dict(_lstm_state({part: arrays[f"lstm{layer}.{part}"][0] for part in "WRB"}))
    network.head.set_columns(columns, biases)
    return network


def _head_tensor(array: npt.NDArray[np.float32]) -> torch.Tensor:
    """Logits first, the padding columns cut off: [12, descriptor] or [12]."""
    return torch.from_numpy(array.T[: len(EMOTIONS) + 1].copy())


def _lstm_state(weights: Mapping[str, npt.NDArray[np.float32]]) -> dict[str, torch.Tensor]:
    """The state_dict of a torch LSTM from W, R and B of the ONNX one."""
    bias_ih, bias_hh = np.split(weights["B"], 2)
    stacked = {"weight_ih_l0": weights["W"], "weight_hh_l0": weights["R"], "bias_ih_l0": bias_ih, "bias_hh_l0": bias_hh}
    return {name: torch.from_numpy(_restack(value, ONNX_GATES, TORCH_GATES)) for name, value in stacked.items()}


def _restack(stacked: npt.NDArray[np.float32], order: str, wanted: str) -> npt.NDArray[np.float32]:
    """Four gates stacked along the first axis in one order, restacked in another."""
    gates = dict(zip(order, np.split(stacked, 4), strict=True))
    return np.concatenate([gates[gate] for gate in wanted])
