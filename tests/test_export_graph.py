"""The model file's graph: the same numbers as torch, and the same bits however frames are grouped into calls."""

import numpy as np
import onnx
import pytest
import torch
from onnx.reference import ReferenceEvaluator

from fervor.model import Model
from fervor_export.builder import LANES
from fervor_export.graph import IR_VERSION, OPSET, build_model
from fervor_export.parity import edge_rotations
from networks import CONFIGS, frames, metadata, model_bytes, network


@pytest.fixture(params=CONFIGS, ids=lambda config: f"{config.features} {config.head}")
def config(request):
    return request.param


@pytest.fixture
def model(config) -> Model:
    return Model.load(model_bytes(config))


def joined(outputs) -> np.ndarray:
    return np.concatenate([outputs.intensity[..., None], outputs.intensity_by_emotion], -1)


def same(ours, theirs) -> None:
    """Equal to the bit: NaN and the sign of zero included."""
    np.testing.assert_array_equal(
        np.ascontiguousarray(ours).view(np.uint32), np.ascontiguousarray(theirs).view(np.uint32)
    )


def test_torch_and_onnxruntime_agree(config, model):
    data = frames(19, 77)
    outputs = model.run(*data, model.zero_states(19))
    with torch.no_grad():
        expected = network(config)(*map(torch.from_numpy, data))
    np.testing.assert_allclose(outputs.intensity, expected.intensity, atol=2e-6)
    np.testing.assert_allclose(outputs.intensity_by_emotion, expected.intensity_by_emotion, atol=2e-6)
    for name, state in outputs.states.items():
        np.testing.assert_allclose(state, expected.states[name], atol=1e-5, rtol=1e-5)
    assert outputs.intensity.std() > 0.1  # something to agree about


def test_the_reference_implementation_agrees(config, model):
    rotations, mask, emotion = frames(2, 4)
    rotations[0, 1, :3] = edge_rotations()[[0, 40, 90]]
    states = model.zero_states(2)
    proto = onnx.load_from_string(model_bytes(config))
    names = [output.name for output in proto.graph.output]
    with np.errstate(divide="ignore"):  # 1 / 0 tells the sign of zero
        values = ReferenceEvaluator(proto).run(
            names, {"rotations": rotations, "mask": mask, "emotion": emotion, **states}
        )
    expected = dict(zip(names, values, strict=True))
    outputs = model.run(rotations, mask, emotion, states)
    np.testing.assert_allclose(outputs.intensity, expected["intensity"], atol=1e-5)
    np.testing.assert_allclose(outputs.intensity_by_emotion, expected["intensity_by_emotion"], atol=1e-5)
    for name, state in outputs.states.items():
        np.testing.assert_allclose(state, expected[f"next_{name}"], atol=1e-4)


def test_steps_are_the_sequence_to_the_bit(model):
    data = frames(5, 60)
    whole = model.run(*data, model.zero_states(5))
    states, steps = model.zero_states(5), []
    for time in range(60):
        outputs = model.run(*(array[:, time : time + 1] for array in data), states)
        states = outputs.states
        steps.append(joined(outputs))
    same(np.concatenate(steps, 1), joined(whole))
    for name, state in states.items():
        same(state, whole.states[name])


def test_batches_of_any_size_are_single_rows_to_the_bit(model):
    size, time = 70, 3
    data = frames(size, time)
    alone = [model.run(*(array[row : row + 1] for array in data), model.zero_states(1)) for row in range(size)]
    for batch in range(1, size + 1):
        rows = slice(size - batch, size)  # so that every body takes every place
        outputs = model.run(*(array[rows] for array in data), model.zero_states(batch))
        same(joined(outputs), np.concatenate([joined(one) for one in alone[rows]]))
        for name, state in outputs.states.items():
            same(state, np.concatenate([one.states[name] for one in alone[rows]]))


def test_neighbours_do_not_matter_not_even_broken_ones(model):
    data = frames(9, 12)
    alone = model.run(*(array[4:5] for array in data), model.zero_states(1))
    rotations = data[0].copy()
    rotations[:4], rotations[5:] = np.nan, np.inf
    beside = model.run(rotations, *data[1:], model.zero_states(9))
    same(joined(beside)[4], joined(alone)[0])
    assert np.isfinite(joined(beside)).all()


def test_states_from_elsewhere_continue_to_the_bit(model):
    data = frames(3, 20)
    whole = model.run(*data, model.zero_states(3))
    first = model.run(*(array[:, :13] for array in data), model.zero_states(3))
    sent = {
        name: np.frombuffer(state.tobytes(), np.float32).reshape(state.shape) for name, state in first.states.items()
    }
    rest = model.run(*(array[:, 13:] for array in data), sent)
    same(np.concatenate([joined(first), joined(rest)], 1), joined(whole))


def test_flipped_hemispheres_change_no_estimate(config, model):
    data = frames(4, 30)
    flips = np.random.default_rng(0).choice(np.float32([-1, 1]), (4, 30, 13, 1))
    same(
        joined(model.run(data[0] * flips, *data[1:], model.zero_states(4))),
        joined(model.run(*data, model.zero_states(4))),
    )


def test_edges_are_finite(model):
    edges = edge_rotations().astype(np.float32)
    rotations = edges[np.random.default_rng(0).integers(len(edges), size=(40, 20, 13))]
    _, _, emotion = frames(40, 20)
    outputs = model.run(rotations, np.ones((40, 20, 13), np.float32), emotion, model.zero_states(40))
    assert np.isfinite(joined(outputs)).all()
    assert all(np.isfinite(state).all() for state in outputs.states.values())


def test_one_hot_labels_pick_their_emotion_to_the_bit(model):
    rotations, mask, _ = frames(11, 6)
    emotion = np.ascontiguousarray(np.broadcast_to(np.eye(11, dtype=np.float32)[:, None], (11, 6, 11)))
    outputs = model.run(rotations, mask, emotion, model.zero_states(11))
    for index in range(11):
        same(outputs.intensity[index], outputs.intensity_by_emotion[index, :, index])


def test_a_file_for_old_runtimes_with_named_weights(config):
    model = build_model(network(config), metadata(config))
    assert (model.opset_import[0].version, model.ir_version) == (OPSET, IR_VERSION)
    assert OPSET >= 18
    assert IR_VERSION <= 10  # what onnxruntime 1.20 reads
    names = {tensor.name for tensor in model.graph.initializer}
    assert {"lstm1.W", "lstm1.R", "lstm1.B", "lstm2.W", "head.weight", "head.bias"} <= names
    assert model.SerializeToString() == build_model(network(config), metadata(config)).SerializeToString()


def test_what_could_have_a_vector_tail_has_none(config):
    model = onnx.shape_inference.infer_shapes(onnx.load_from_string(model_bytes(config)))
    shapes = {value.name: [d.dim_value for d in value.type.tensor_type.shape.dim] for value in model.graph.value_info}
    delicate = [node for node in model.graph.node if node.op_type in {"Sigmoid", "Atan", "Tanh", "Exp"}]
    assert delicate
    for node in delicate:
        assert np.prod([size for size in shapes[node.output[0]] if size]) % LANES == 0
