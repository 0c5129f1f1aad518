"""The model repository for Triton, read with Triton's own schema; its model gives our numbers."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest

from containers import need_module
from fervor.errors import ModelFileError
from fervor.model import Model, default_model_path
from fervor_export.triton import write_repository
from networks import CONFIGS, frames, model_bytes


@pytest.fixture(scope="module")
def schema() -> Any:
    """Triton's model_config.proto as a module, without the gRPC client that it comes with."""
    (place,) = need_module("tritonclient").__path__
    spec = importlib.util.spec_from_file_location("model_config_pb2", Path(place) / "grpc" / "model_config_pb2.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def config_of(version: Path, schema: Any) -> Any:
    from google.protobuf import text_format

    return text_format.Parse((version.parent / "config.pbtxt").read_text(encoding="utf-8"), schema.ModelConfig())


@pytest.mark.parametrize("network", CONFIGS, ids=str)
def test_the_config_describes_the_model_file(network, schema: Any, tmp_path: Path) -> None:
    model_file = tmp_path / "mine.onnx"
    model_file.write_bytes(model_bytes(network))
    version = write_repository(model_file, tmp_path / "repository")
    config = config_of(version, schema)
    assert (config.name, config.platform) == ("test", "onnxruntime_onnx")
    assert version == tmp_path / "repository" / config.name / "1"
    session = onnxruntime.InferenceSession(version / "model.onnx")
    for told, real in ((config.input, session.get_inputs()), (config.output, session.get_outputs())):
        assert [(tensor.name, tensor.data_type, list(tensor.dims)) for tensor in told] == [
            (tensor.name, schema.TYPE_FP32, [size if isinstance(size, int) else -1 for size in tensor.shape[1:]])
            for tensor in real
        ]
        assert all(tensor.type == "tensor(float)" and tensor.shape[0] == "batch" for tensor in real)
    assert config.max_batch_size > 1
    assert config.HasField("dynamic_batching")
    assert not config.HasField("sequence_batching")


def test_its_model_gives_the_numbers_of_ours(tmp_path: Path) -> None:
    """As Triton would: rows of several clients together, each one's state handed back to it by name."""
    version = write_repository(default_model_path(), tmp_path)
    session = onnxruntime.InferenceSession(version / "model.onnx")
    names = [output.name for output in session.get_outputs()]
    ours = Model.load(default_model_path())
    rotations, mask, emotion = frames(5, 6)
    states = ours.zero_states(5)
    expected = ours.run(rotations, mask, emotion, states)
    for time in range(6):
        now = slice(time, time + 1)
        feed = {"rotations": rotations[:, now], "mask": mask[:, now], "emotion": emotion[:, now], **states}
        given = dict(zip(names, session.run(names, feed), strict=True))
        states = {name: given[f"next_{name}"] for name in states}
        assert np.array_equal(given["intensity"], expected.intensity[:, now])
    assert all(np.array_equal(states[name], expected.states[name]) for name in states)


def test_a_changed_model_is_a_new_version_and_the_same_one_is_not(tmp_path: Path) -> None:
    model_file = tmp_path / "mine.onnx"
    model_file.write_bytes(model_bytes(CONFIGS[0]))
    first = write_repository(model_file, tmp_path / "repository")
    assert write_repository(model_file, tmp_path / "repository") == first
    model_file.write_bytes(model_bytes(CONFIGS[1]))
    second = write_repository(model_file, tmp_path / "repository")
    assert (first.name, second.name) == ("1", "2")
    assert (first / "model.onnx").read_bytes() != (second / "model.onnx").read_bytes()


def test_a_file_that_the_service_refuses_is_not_written(tmp_path: Path) -> None:
    model_file = tmp_path / "bad.onnx"
    model_file.write_bytes(b"no model")
    with pytest.raises(ModelFileError, match=r"bad\.onnx is not an ONNX file"):
        write_repository(model_file, tmp_path / "repository")
    assert not (tmp_path / "repository").exists()
