"""The contract inside a model file."""

import json

import pytest

from fervor.errors import ModelFileError
from fervor.metadata import METADATA_KEY, ModelMetadata
from fervor.model import Model, default_model_path


@pytest.fixture(scope="module")
def metadata() -> ModelMetadata:
    return Model.load(default_model_path()).metadata


def test_round_trip(metadata):
    assert ModelMetadata.from_props(metadata.to_props(), where="x") == metadata


def changed(metadata: ModelMetadata, **changes: object) -> dict[str, str]:
    return {METADATA_KEY: json.dumps(json.loads(metadata.model_dump_json()) | changes)}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"metadata_version": 2}, "metadata_version"),
        ({"purpose": "science"}, "purpose"),
        ({"rate_hz": 0}, "rate_hz"),
        ({"levels": {"threshold": {"joy": 0.5}}}, "thresholds are missing for amusement"),
        ({"features": "quaternion"}, "features"),
    ],
)
def test_another_contract_is_refused_saying_what_differs(metadata, changes, told):
    with pytest.raises(ModelFileError, match=r"model\.onnx has metadata this service can't use: ") as caught:
        ModelMetadata.from_props(changed(metadata, **changes), where="model.onnx")
    assert told in caught.value.message


def test_a_file_without_our_entry_is_named():
    with pytest.raises(ModelFileError, match=r"resnet\.onnx is not a fervor model"):
        ModelMetadata.from_props({}, where="resnet.onnx")
