"""The comparison of torch and onnxruntime, and that nothing is left where it fails."""

import numpy as np
import onnx
import pytest
import torch

from fervor.errors import ModelFileError
from fervor.model import Model
from fervor_export.export import export_model, library_versions
from fervor_export.graph import build_model
from fervor_export.parity import MOST, TOLERANCE, check_parity, edge_rotations
from networks import CONFIGS, DEFAULT, metadata, model_bytes, network


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: f"{config.features} {config.head}")
def test_network_and_file_agree(config):
    report = check_parity(network(config), Model.load(model_bytes(config)))
    assert report.agrees
    assert report.largest < TOLERANCE
    assert report.cases == 9


def test_other_weights_are_seen():
    report = check_parity(network(seed=1), Model.load(model_bytes()))
    assert not report.agrees


def test_a_single_weight_is_seen():
    changed = network()
    with torch.no_grad():
        changed.lstm2.weight_hh_l0[3, 5] += 1e-2
    assert not check_parity(changed, Model.load(model_bytes())).agrees


def test_a_steep_network_is_held_to_what_float32_can_give():
    trained = network()
    with torch.no_grad():
        for lstm in (trained.lstm1, trained.lstm2):
            lstm.weight_ih_l0 *= 2
            lstm.weight_hh_l0 *= 2
    file = Model.load(build_model(trained, metadata()).SerializeToString())
    report = check_parity(trained, file)
    assert TOLERANCE < report.largest <= report.allowed <= MOST
    with torch.no_grad():
        trained.lstm2.weight_hh_l0[3, 5] += 1e-2
    assert not check_parity(trained, file).agrees


def test_not_a_number_is_no_agreement():
    broken = network()
    with torch.no_grad():
        broken.head.shared.bias[:] = np.nan
    report = check_parity(broken, Model.load(model_bytes()))
    assert np.isnan(report.largest)
    assert not report.agrees


def test_the_network_stays_in_its_mode():
    trained = network().train()
    check_parity(trained, Model.load(model_bytes()))
    assert trained.training


def test_edges_are_rotations_or_zero():
    edges = edge_rotations()
    norms = np.linalg.norm(edges, axis=-1)
    np.testing.assert_allclose(norms[:-1], 1)
    assert norms[-1] == 0
    assert (edges == np.asarray([0.5, 0.5, -0.5, 0.5])).all(-1).any()


def test_export_writes_a_file_the_service_takes(tmp_path):
    path = tmp_path / "deep" / "model.onnx"
    report = export_model(network(), metadata(), path)
    assert report.agrees
    assert Model.load(path).metadata == metadata()
    assert [file.name for file in path.parent.iterdir()] == ["model.onnx"]


def test_export_leaves_nothing_where_results_differ(tmp_path, monkeypatch):
    other = network(seed=1)
    proto = onnx.load_from_string(model_bytes())
    monkeypatch.setattr("fervor_export.export.build_model", lambda network, metadata: proto)
    path = tmp_path / "model.onnx"
    with pytest.raises(ModelFileError, match=r"model\.onnx was not written: results would differ"):
        export_model(other, metadata(), path)
    assert not list(tmp_path.iterdir())
    path.write_bytes(b"before")
    with pytest.raises(ModelFileError):
        export_model(other, metadata(), path)
    assert path.read_bytes() == b"before"


def test_metadata_of_another_network_are_refused(tmp_path):
    for changes, told in (
        ({"features": "euler"}, "feature set euler, but the network has rot6d"),
        ({"rate_hz": 60.0}, r"rate 60\.0, but the network has 30\.0"),
        ({"states": DEFAULT.states[:4]}, "states"),
    ):
        with pytest.raises(ModelFileError, match=f"the metadata says {told}"):
            export_model(network(), metadata(**changes), tmp_path / "model.onnx")


def test_versions():
    assert {"fervor", "torch", "onnx", "onnxruntime", "numpy", "python"} == library_versions().keys()
