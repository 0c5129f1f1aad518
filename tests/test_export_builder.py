"""The pieces graphs are built from."""

import numpy as np
import onnxruntime
import torch
from onnx import TensorProto, helper

import fervor.model  # noqa: F401  # first: it keeps onnxruntime from reporting to its maker
from fervor_export.builder import GraphBuilder, atan2
from fervor_export.graph import IR_VERSION, OPSET


def run(build: GraphBuilder, output: str, **inputs: np.ndarray) -> np.ndarray:
    tensors = [helper.make_tensor_value_info(name, TensorProto.FLOAT, array.shape) for name, array in inputs.items()]
    graph = helper.make_graph(
        build.nodes,
        "test",
        tensors,
        [helper.make_tensor_value_info(output, TensorProto.FLOAT, None)],
        initializer=list(build.initializers.values()),
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return session.run([output], inputs)[0]


def test_atan2_is_torchs_with_its_signs():
    values = np.float32([0.0, -0.0, 1e-30, -1e-30, 1e-4, -1e-4, 0.5, -0.5, 1.0, -1.0, 3.0, -3.0])
    y, x = (grid.ravel() for grid in np.meshgrid(values, values))
    y, x = y.reshape(-1, 16), x.reshape(-1, 16)
    build = GraphBuilder()
    angles = run(build, atan2(build, "y", "x", name="angle"), y=y, x=x)
    origin = (x == 0) & (y == 0)
    expected = torch.atan2(torch.from_numpy(y), torch.from_numpy(x)).numpy()
    np.testing.assert_allclose(angles[~origin], expected[~origin], atol=5e-7)
    np.testing.assert_array_equal(np.sign(angles[~origin]), np.sign(expected[~origin]))
    assert not angles[origin].any()


def test_atan2_has_the_same_bits_for_any_number_of_rows():
    random = np.random.default_rng(0)
    y, x = (random.standard_normal((70, 16)).astype(np.float32) for _ in range(2))
    build = GraphBuilder()
    name = atan2(build, "y", "x", name="angle")
    together = run(build, name, y=y, x=x)
    for rows in (1, 2, 3, 7, 33):
        np.testing.assert_array_equal(run(build, name, y=y[:rows], x=x[:rows]), together[:rows])


def test_constants_keep_their_shape_and_are_stored_once():
    build = GraphBuilder()
    assert build.number(0.5) == build.number(0.5)
    assert build.indices(0, 1) == build.indices(0, 1)
    assert len(build.initializers) == 2
    assert list(build.initializers[build.number(0.5)].dims) == []


def test_slices_and_columns():
    build = GraphBuilder()
    build.slice("a", 1, 3, -1, name="middle")
    build.columns("middle", [1, 0, 0], name="picked")
    picked = run(build, "picked", a=np.arange(8, dtype=np.float32).reshape(2, 4))
    np.testing.assert_array_equal(picked, [[2, 1, 1], [6, 5, 5]])
