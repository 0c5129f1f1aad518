"""Weights between torch and the model file."""

import numpy as np
import onnx
import pytest
import torch
from onnx import numpy_helper

from fervor.errors import ModelFileError
from fervor_export.graph import build_model
from fervor_export.weights import lstm_weights, network_from_model_file
from networks import CONFIGS, frames, metadata, model_bytes, network


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: f"{config.features} {config.head}")
def test_a_model_file_gives_its_network_back(config, tmp_path):
    path = tmp_path / "model.onnx"
    path.write_bytes(model_bytes(config))
    original, copy = network(config), network_from_model_file(path)
    assert copy.config == config
    for name, weight in original.lstm1.state_dict().items() | original.lstm2.state_dict().items():
        assert any(torch.equal(weight, other) for other in (copy.get_parameter(f"lstm{n}.{name}") for n in (1, 2)))
    data = tuple(map(torch.from_numpy, frames(4, 20)))
    with torch.no_grad():
        ours, theirs = original(*data), copy(*data)
    torch.testing.assert_close(ours.intensity, theirs.intensity, atol=1e-6, rtol=0)
    torch.testing.assert_close(ours.intensity_by_emotion, theirs.intensity_by_emotion, atol=1e-6, rtol=0)
    for name, state in ours.states.items():
        assert torch.equal(state, theirs.states[name])


def test_gates_are_stacked_as_onnx_has_them():
    lstm = torch.nn.LSTM(2, 3)
    rows = lstm.weight_hh_l0.detach().numpy().reshape(4, 3, 3)
    i, f, g, o = rows
    np.testing.assert_array_equal(lstm_weights(lstm)["R"][0], np.concatenate([i, o, f, g]))
    biases = np.concatenate([lstm.bias_ih_l0.detach().numpy(), lstm.bias_hh_l0.detach().numpy()])
    assert sorted(lstm_weights(lstm)["B"][0]) == sorted(biases)


def test_what_is_no_model_file_is_refused(tmp_path):
    path = tmp_path / "model.onnx"
    with pytest.raises(ModelFileError, match="can't be read as an ONNX file"):
        network_from_model_file(path)
    path.write_bytes(b"\x08\x07no protobuf")
    with pytest.raises(ModelFileError, match=r"can't be read as an ONNX file|is not a fervor model"):
        network_from_model_file(path)


def test_a_fervor_model_of_another_exporter_is_refused(tmp_path):
    model = build_model(network(), metadata())
    kept = [tensor for tensor in model.graph.initializer if tensor.name != "lstm2.R"]
    del model.graph.initializer[:]
    model.graph.initializer.extend([*kept, numpy_helper.from_array(np.zeros(1, np.float32), "other")])
    onnx.save(model, tmp_path / "model.onnx")
    with pytest.raises(ModelFileError, match=r"was not written by this exporter: it lacks the weights lstm2\.R"):
        network_from_model_file(tmp_path / "model.onnx")
