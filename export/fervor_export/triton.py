"""A model repository for Triton Inference Server: the model file as it is, and a `config.pbtxt` that describes it.

The recurrent state goes in and out as ordinary tensors, as everywhere in fervor: whoever asks keeps it. Triton's own
sequence batcher would keep it on one server, where it dies with it, and without a name.
"""

import re
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import onnx

from fervor.errors import ModelFileError
from fervor.model import Model

MOST_ROWS = 256
"""Bodies in one run, as in the service; more gain nothing (docs, "Performance")."""

QUEUE_DELAY_US = 1000
"""Microseconds that Triton may wait for company of a request, as in the service under load."""

KEPT_VERSIONS = 2
"""Versions served at once: a stream must end on the version that its state comes from."""

MODEL_FILE = "model.onnx"


@dataclass(frozen=True, slots=True)
class Tensor:
    """An input or an output, without its batch axis; -1 is any size."""

    name: str
    dims: tuple[int, ...]


def write_repository(model_file: Path, repository: Path) -> Path:
    """Add a model file to a repository as the newest version of the model it names.

    Args:
        model_file: one that the service takes.
        repository: folder that Triton's `--model-repository` names; made if need be.

    Returns:
        The folder of the version: a new number, or the newest one where that holds the same file.

    Raises:
        ModelFileError: the service would not take the file either, or it can't be read.
    """
    model = Model.load(model_file)
    folder = repository / re.sub(r"[^\w.-]", "_", model.metadata.name)
    version = _version(folder, model_file)
    version.mkdir(parents=True, exist_ok=True)
    draft = version / f"{MODEL_FILE}.part"
    shutil.copyfile(model_file, draft)
    draft.replace(version / MODEL_FILE)
    inputs, outputs = _tensors(model_file)
    config = folder / "config.pbtxt"
    config.write_text(_config(folder.name, inputs, outputs), encoding="utf-8")
    return version


def _version(folder: Path, model_file: Path) -> Path:
    numbers = sorted(int(entry.name) for entry in folder.glob("*") if entry.name.isdecimal())
    if numbers:
        newest = folder / str(numbers[-1])
        there = newest / MODEL_FILE
        if there.is_file() and there.read_bytes() == model_file.read_bytes():
            return newest
    return folder / str(1 + max(numbers, default=0))


def _tensors(model_file: Path) -> tuple[list[Tensor], list[Tensor]]:
    """What the graph takes and gives."""
    graph = onnx.load(model_file, load_external_data=False).graph
    return [_tensor(info) for info in graph.input], [_tensor(info) for info in graph.output]


def _tensor(info: onnx.ValueInfoProto) -> Tensor:
    kind = info.type.tensor_type
    if kind.elem_type != onnx.TensorProto.FLOAT:  # Model.load has refused such a file
        raise ModelFileError(f"{info.name} is not float32")
    return Tensor(info.name, tuple(axis.dim_value or -1 for axis in kind.shape.dim[1:]))


def _config(name: str, inputs: Iterable[Tensor], outputs: Iterable[Tensor]) -> str:
    """The text of `config.pbtxt`; what each field means is said in Triton's model_config.proto."""
    return f"""\
name: "{name}"
platform: "onnxruntime_onnx"
max_batch_size: {MOST_ROWS}
{_listed("input", inputs)}
{_listed("output", outputs)}
dynamic_batching {{ max_queue_delay_microseconds: {QUEUE_DELAY_US} }}
version_policy {{ latest {{ num_versions: {KEPT_VERSIONS} }} }}
instance_group [ {{ kind: KIND_CPU count: 1 }} ]
parameters {{ key: "intra_op_thread_count" value: {{ string_value: "1" }} }}
parameters {{ key: "inter_op_thread_count" value: {{ string_value: "1" }} }}
"""


def _listed(field: str, tensors: Iterable[Tensor]) -> str:
    return "\n".join(
        f'{field} {{ name: "{tensor.name}" data_type: TYPE_FP32 dims: [{", ".join(map(str, tensor.dims))}] }}'
        for tensor in tensors
    )
