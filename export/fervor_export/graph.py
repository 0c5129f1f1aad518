"""The model file's graph, written node by node.

Why not torch's exporters: as measured, the TorchScript one gives NaN at q = (.5, .5, -.5, .5) and a wrong LSTM, the
dynamo one bakes the example's length into nn.LSTM in spite of a dynamic axis, and both are wrong near half turns,
because ONNX has no atan2.

Rules that make n single steps, one call over n frames and any batch agree to the bit (tested):
- weights are initialisers, so that onnxruntime packs them once and uses one kernel for any number of rows;
- Sigmoid and Atan, whose vectorised and scalar code differ in the last bit, work on axes padded to 16: no tail;
- all else is plain arithmetic and selection, which rounds alike everywhere.
"""

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper

from fervor.emotions import EMOTIONS
from fervor.metadata import EMOTION, INTENSITY, INTENSITY_BY_EMOTION, MASK, NEXT, ROTATIONS, ModelMetadata
from fervor.skeletons.rig import JOINTS
from fervor_export.builder import LANES, GraphBuilder
from fervor_export.feature_graph import feature_nodes
from fervor_export.network import Network, NetworkConfig
from fervor_export.weights import lstm_weights

OPSET = 18
IR_VERSION = 9
"""Both as old as they can be: onnxruntime 1.20 and later read them."""


def build_model(network: Network, metadata: ModelMetadata) -> onnx.ModelProto:
    """The ONNX model of a network, its contract in metadata_props."""
    config = network.config
    build = GraphBuilder()
    features, nexts = feature_nodes(build, config)
    sequence = build.op("Transpose", features, name="features.by_time", perm=[1, 0, 2])  # [time, batch, feature]
    for layer, lstm in ((1, network.lstm1), (2, network.lstm2)):
        sequence, states = _lstm_nodes(build, lstm, sequence, layer)
        nexts |= states
    _head_nodes(build, network, sequence)
    for state, tensor in nexts.items():
        build.op("Identity", tensor, name=NEXT + state)
    graph = helper.make_graph(
        build.nodes,
        "fervor",
        _inputs(config),
        _outputs(config),
        initializer=list(build.initializers.values()),
        doc_string=f"{config.features} → LSTM({config.hidden1}) → LSTM({config.hidden2}) → {config.head} head",
    )
    opsets = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, producer_name="fervor", opset_imports=opsets, ir_version=IR_VERSION)
    helper.set_model_props(model, metadata.to_props())
    onnx.checker.check_model(model, full_check=True)
    return model


def _inputs(config: NetworkConfig) -> list[onnx.ValueInfoProto]:
    return [
        _tensor(ROTATIONS, "batch", "time", len(JOINTS), 4),
        _tensor(MASK, "batch", "time", len(JOINTS)),
        _tensor(EMOTION, "batch", "time", len(EMOTIONS)),
        *(_tensor(state.name, "batch", *state.shape) for state in config.states),
    ]


def _outputs(config: NetworkConfig) -> list[onnx.ValueInfoProto]:
    return [
        _tensor(INTENSITY, "batch", "time"),
        _tensor(INTENSITY_BY_EMOTION, "batch", "time", len(EMOTIONS)),
        *(_tensor(NEXT + state.name, "batch", *state.shape) for state in config.states),
    ]


def _tensor(name: str, *shape: int | str) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)


def _lstm_nodes(build: GraphBuilder, lstm: torch.nn.LSTM, sequence: str, layer: int) -> tuple[str, dict[str, str]]:
    """One LSTM over [time, batch, feature]: its hidden states [time, batch, hidden], and what its states become."""
    weights = [build.constant(f"lstm{layer}.{part}", array) for part, array in lstm_weights(lstm).items()]
    h, c = (
        build.op("Unsqueeze", f"{part}{layer}", build.indices(0), name=f"lstm{layer}.initial_{part}") for part in "hc"
    )
    y, y_h, y_c = (f"lstm{layer}.{output}" for output in ("Y", "Y_h", "Y_c"))
    no_lengths = ""
    build.nodes.append(
        helper.make_node(
            "LSTM",
            [sequence, *weights, no_lengths, h, c],
            [y, y_h, y_c],
            name=f"lstm{layer}",
            hidden_size=lstm.hidden_size,
        )
    )
    after = {
        f"{part}{layer}": build.op("Squeeze", output, build.indices(0), name=f"lstm{layer}.last_{part}")
        for part, output in (("h", y_h), ("c", y_c))
    }
    return build.op("Squeeze", y, build.indices(1), name=f"lstm{layer}.hidden"), after


def _head_nodes(build: GraphBuilder, network: Network, descriptor: str) -> None:
    """Logits in 16 columns: the emotions, then the mixture for E in the place of unknown, then padding."""
    weight, bias = (tensor.detach().numpy() for tensor in network.head.columns())
    count, pad = len(EMOTIONS), LANES - len(bias)
    columns = build.constant("head.weight", np.pad(weight.T, ((0, 0), (0, pad))))  # [descriptor, 16]
    product = build.op("MatMul", descriptor, columns, name="head.product")
    by_time = build.op("Add", product, build.constant("head.bias", np.pad(bias, (0, pad))), name="head.by_time")
    logits = build.op("Transpose", by_time, name="head.logits", perm=[1, 0, 2])  # [batch, time, 16]
    weighted = build.op("Mul", _mixture_nodes(build), logits, name="mixture.terms")
    mixed = build.op("ReduceSum", weighted, build.indices(-1), name="mixture.logit", keepdims=1)
    here = build.constant("mixture.column", np.arange(LANES) == count, np.bool_)
    intensities = build.op("Sigmoid", build.op("Where", here, mixed, logits, name="logits"), name="intensities")
    build.op("Gather", intensities, build.constant("mixture.index", count, np.int64), name=INTENSITY, axis=-1)
    build.slice(intensities, 0, count, -1, name=INTENSITY_BY_EMOTION)


def _mixture_nodes(build: GraphBuilder) -> str:
    """`network.mixture` in 16 columns: E, then 1 - ΣE, then zeros; [batch, time, 16]."""
    count = len(EMOTIONS)
    share = np.eye(count, LANES)
    share[:, count] = -1.0
    spread = build.op("MatMul", EMOTION, build.constant("mixture.share", share), name="mixture.spread")
    return build.op("Add", spread, build.constant("mixture.rest", np.eye(1, LANES, count)[0]), name="mixture")
