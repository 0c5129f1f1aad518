"""The model file at run time: loaded, checked against its contract, and run. The only place that knows onnxruntime.

A model holds no state of any body: states go in and come out with every call. Inputs and outputs are paired by name.
One thread and no spinning: the service scales by processes, and threads of our own would escape their CPU.

`Model.load` refuses every file that the service could not serve, in one sentence that says what differs. What may
differ between machines, the last bits of a row's result, is checked by `check_row_independence`.
"""

import hashlib
import math
import os
import platform
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

# Since 1.29 onnxruntime reports to its maker what it runs, unless this is set before it is imported.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import onnxruntime
from onnxruntime.capi import onnxruntime_pybind11_state as ort_errors

from fervor.emotions import EMOTIONS
from fervor.errors import EngineError, ModelFileError
from fervor.metadata import EMOTION, INTENSITY, INTENSITY_BY_EMOTION, MASK, NEXT, ROTATIONS, ModelMetadata
from fervor.skeletons.rig import JOINTS, PARENTS

Floats = npt.NDArray[np.float32]

_WATCHED = 12
"""Bodies whose results are compared: a kernel's block and its remainder; more would only cost time."""

BATCH_MULTIPLES: tuple[int, ...] = (1, 2, 4, 8, 16)
"""Batch sizes tried, smallest first, by `check_row_independence`."""

_RUNTIME_ERRORS: tuple[type[Exception], ...] = (
    ort_errors.EPFail,
    ort_errors.Fail,
    ort_errors.InvalidArgument,
    ort_errors.InvalidGraph,
    ort_errors.InvalidProtobuf,
    ort_errors.NoModel,
    ort_errors.NoSuchFile,
    ort_errors.NotImplemented,
    ort_errors.RuntimeException,
    RuntimeError,
    ValueError,
)
"""onnxruntime's exceptions have no common parent but Exception."""


class _Frames(NamedTuple):
    """What goes into a run beside the states."""

    rotations: Floats  # [batch, time, 13, 4]
    mask: Floats  # [batch, time, 13]
    emotion: Floats  # [batch, time, 11]

    def rows(self, rows: slice | npt.NDArray[np.intp]) -> "_Frames":
        return _Frames(*(np.ascontiguousarray(array[rows]) for array in self))

    def times(self, start: int, stop: int) -> "_Frames":
        return _Frames(*(np.ascontiguousarray(array[:, start:stop]) for array in self))


@dataclass(frozen=True, slots=True, eq=False)
class Outputs:
    """What one call gives."""

    intensity: Floats  # [batch, time]
    intensity_by_emotion: Floats  # [batch, time, 11]
    states: dict[str, Floats]  # name -> [batch, *shape], after the last frame


class Model:
    """A model file that met the contract, ready to run."""

    __slots__ = ("_output_names", "_session", "fingerprint", "metadata", "sha256")

    metadata: ModelMetadata
    sha256: str
    """Of the file, in hexadecimal."""
    fingerprint: str
    """16 hexadecimal digits of file, onnxruntime version and CPU kind: where they agree, results agree to the bit."""

    def __init__(self, session: onnxruntime.InferenceSession, metadata: ModelMetadata, sha256: str) -> None:
        self._session = session
        self.metadata = metadata
        self.sha256 = sha256
        self.fingerprint = _fingerprint(sha256)
        self._output_names = [INTENSITY, INTENSITY_BY_EMOTION, *(NEXT + state.name for state in metadata.states)]

    @classmethod
    def load(cls, source: str | Path | bytes) -> "Model":
        """Load and check a model file, given by path or by content.

        Raises:
            ModelFileError: it can't be read, is no fervor model, or has a contract this service can't meet; the
                message says what differs.
        """
        where, content = _read(source)
        try:
            session = onnxruntime.InferenceSession(content, _options(), providers=["CPUExecutionProvider"])
        except _RUNTIME_ERRORS as error:
            raise ModelFileError(
                f"{where} is not an ONNX file that onnxruntime can run: {_first_line(error)}"
            ) from error
        metadata = ModelMetadata.from_props(session.get_modelmeta().custom_metadata_map, where=where)
        _check_vocabulary(metadata, where)
        _check_tensors("input", session.get_inputs(), _expected_inputs(metadata), where)
        _check_tensors("output", session.get_outputs(), _expected_outputs(metadata), where)
        model = cls(session, metadata, hashlib.sha256(content).hexdigest())
        _check_step(model, where)
        return model

    def zero_states(self, batch: int) -> dict[str, Floats]:
        """The states of `batch` bodies at a reset: name -> [batch, *shape]."""
        return {state.name: np.zeros((batch, *state.shape), np.float32) for state in self.metadata.states}

    def run(self, rotations: Floats, mask: Floats, emotion: Floats, states: Mapping[str, Floats]) -> Outputs:
        """Run `time` frames of each of `batch` bodies.

        Args:
            rotations: [batch, time, 13, 4] xyzw, local, rig C13.
            mask: [batch, time, 13], 1 observed.
            emotion: [batch, time, 11], probabilities; all zero is unknown.
            states: name -> [batch, *shape], from `zero_states` or the call before.

        Raises:
            EngineError: onnxruntime failed.
        """
        feed = {ROTATIONS: rotations, MASK: mask, EMOTION: emotion, **states}
        try:
            intensity, by_emotion, *after = self._session.run(self._output_names, feed)
        except _RUNTIME_ERRORS as error:
            raise EngineError(f"model {self.metadata.name} failed to run: {_first_line(error)}") from error
        names = (state.name for state in self.metadata.states)
        return Outputs(intensity, by_emotion, dict(zip(names, after, strict=True)))


def default_model_path() -> Path:
    """The demo model that ships inside the package."""
    return Path(str(files("fervor").joinpath("models", "default.onnx")))


# --- loading --------------------------------------------------------------------------------------------------------


def _read(source: str | Path | bytes) -> tuple[str, bytes]:
    """What to call a source in messages, and its content."""
    if isinstance(source, bytes):
        return "the model", source
    try:
        return str(source), Path(source).read_bytes()
    except OSError as error:
        raise ModelFileError(f"{source} can't be read as a model file: {error.strerror}") from error


def _options() -> onnxruntime.SessionOptions:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.add_session_config_entry("session.inter_op.allow_spinning", "0")
    options.log_severity_level = 4  # fatal: what fails is raised, and nothing prints
    return options


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def _check_vocabulary(metadata: ModelMetadata, where: str) -> None:
    """Rig and emotions must be ours, name by name and in our order."""
    for what, theirs, ours in (
        ("rig joints", metadata.joints, JOINTS),
        ("joint parents", metadata.parents, PARENTS),
        ("emotions", metadata.emotions, EMOTIONS),
    ):
        if tuple(theirs) != tuple(ours):
            raise ModelFileError(f"{where} has the {what} {_listed(theirs)}; this service expects {_listed(ours)}")


def _listed(values: Sequence[object]) -> str:
    return ", ".join(map(str, values)) or "(none)"


def _expected_inputs(metadata: ModelMetadata) -> dict[str, tuple[int | None, ...]]:
    """Name -> shape, None where any size goes."""
    frames = {ROTATIONS: (len(JOINTS), 4), MASK: (len(JOINTS),), EMOTION: (len(EMOTIONS),)}
    return {
        **{name: (None, None, *shape) for name, shape in frames.items()},
        **{state.name: (None, *state.shape) for state in metadata.states},
    }


def _expected_outputs(metadata: ModelMetadata) -> dict[str, tuple[int | None, ...]]:
    """Name -> shape, None where any size goes."""
    return {
        INTENSITY: (None, None),
        INTENSITY_BY_EMOTION: (None, None, len(EMOTIONS)),
        **{NEXT + state.name: (None, *state.shape) for state in metadata.states},
    }


def _check_tensors(
    kind: str, actual: Sequence[onnxruntime.NodeArg], expected: Mapping[str, tuple[int | None, ...]], where: str
) -> None:
    """Names, types and shapes of the graph's inputs or outputs."""
    names = {tensor.name for tensor in actual}
    for difference, verb in ((expected.keys() - names, "lacks"), (names - expected.keys(), "has an unknown")):
        if difference:
            raise ModelFileError(f"{where} {verb} {kind} {_listed(sorted(difference))}")
    for tensor in actual:
        if tensor.type != "tensor(float)":
            raise ModelFileError(f"{where} has {kind} {tensor.name} of type {tensor.type}; expected tensor(float)")
        shape = tuple(size if isinstance(size, int) else None for size in tensor.shape)
        if shape != expected[tensor.name]:
            raise ModelFileError(
                f"{where} has {kind} {tensor.name} of shape {_shape(shape)}; expected {_shape(expected[tensor.name])}"
            )


def _shape(shape: Sequence[int | None]) -> str:
    return "[" + ", ".join("any" if size is None else str(size) for size in shape) + "]"


def _check_step(model: Model, where: str) -> None:
    """Two frames, then one more: dimensions as promised, all numbers finite, intensities in [0, 1]."""
    frames = _random_frames(2, 3, seed=0)
    try:
        outputs = model.run(*frames.times(0, 2), model.zero_states(2))
        outputs = model.run(*frames.times(2, 3), outputs.states)
    except EngineError as error:
        raise ModelFileError(f"{where} fails on a test step: {error.message}") from error
    states = {NEXT + name: state for name, state in outputs.states.items()}
    intensities = {INTENSITY: outputs.intensity, INTENSITY_BY_EMOTION: outputs.intensity_by_emotion}
    for name, value in (intensities | states).items():
        if not np.isfinite(value).all():
            raise ModelFileError(f"{where} gives numbers in {name} that are not finite on a test step")
    for name, value in intensities.items():
        if value.min() < 0.0 or value.max() > 1.0:
            raise ModelFileError(f"{where} gives numbers in {name} outside 0 to 1 on a test step")


# --- sameness -------------------------------------------------------------------------------------------------------


def _fingerprint(sha256: str) -> str:
    parts = (sha256, onnxruntime.__version__, platform.machine(), *_cpu_features())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _cpu_features() -> list[str]:
    """The vector instructions of this CPU, which decide which kernels onnxruntime picks."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return [platform.processor()]
    flags = next((line.partition(":")[2] for line in lines if line.startswith(("flags", "Features"))), "")
    return sorted(
        flag for flag in flags.split() if re.match(r"(sse|ssse|avx|fma|f16c|amx|asimd|sve|sme|bf16|i8mm)", flag)
    )


def _random_frames(batch: int, time: int, *, seed: int) -> _Frames:
    """Moving bodies, some joints unobserved, some emotions mixed or unknown."""
    source = random.Random(seed)  # noqa: S311  # not numpy's: nothing else here needs that, and it takes its time to load

    def uniform(*shape: int) -> npt.NDArray[np.float64]:
        """In (0, 1)."""
        return (np.frombuffer(source.randbytes(4 * math.prod(shape)), "<u4").reshape(shape) + 0.5) / 2**32

    rotations = 2.0 * uniform(batch, time, len(JOINTS), 4) - 1.0
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    mask = uniform(batch, time, len(JOINTS)) < 0.9
    emotion = -np.log(uniform(batch, time, len(EMOTIONS)))  # these shares are of all mixtures alike
    emotion /= emotion.sum(-1, keepdims=True)
    emotion[::3] = np.eye(len(EMOTIONS))[source.randrange(len(EMOTIONS))]
    emotion[1::3] *= 0.5
    emotion[::7] = 0.0
    return _Frames(rotations.astype(np.float32), mask.astype(np.float32), emotion.astype(np.float32))


def check_row_independence(
    model: Model, *, rows: int = 70, frames: int = 5, largest: int = 256, together: int = 48
) -> int:
    """Whether a body's result depends, in any bit, on its batch neighbours or on how frames are grouped into calls.

    Runs the same random bodies frame by frame alone, in batches of many sizes, and as whole sequences.

    Args:
        model: what to run.
        rows: batches of all sizes up to nine are tried, then of odd and even ones up to this.
        frames: length of the sequences.
        largest: one more batch size, the engine's largest.
        together: batches larger than this are run frame by frame only: no more sequences are scored together.

    Returns:
        The smallest multiple to which batches must be padded for results to agree to the bit: 1 where rows are
        independent, as they are on every CPU measured.

    Raises:
        EngineError: no multiple tried makes them agree.
    """
    data = _random_frames(max(rows, largest), frames, seed=1)
    sizes = (*range(2, 10), 12, 13, 16, 17, 31, 32, 33, 48, 63, 64, 65, rows, largest)
    for multiple in BATCH_MULTIPLES:
        tried = [size for size in sizes if size % multiple == 0 and multiple < size <= len(data.mask)]
        if _rows_agree(model, data, multiple, tried, together):
            return multiple
    raise EngineError(
        f"results of model {model.metadata.name} depend on the batch in their last bits, whatever the padding"
    )


def _rows_agree(model: Model, data: _Frames, multiple: int, sizes: Sequence[int], together: int) -> bool:
    """Compare the first and the last rows of batches with the same bodies in the smallest batch allowed."""
    frames = data.rotations.shape[1]
    one_by_one, at_once, uneven = [1] * frames, [frames], [2, frames - 2]
    alone = [
        _row_bits(model, data.rows((row + np.arange(multiple)) % len(data.mask)), one_by_one, [0])[0]
        for row in range(_WATCHED)
    ]
    for size in sizes:
        bodies = np.arange(size)
        last = min(max(size - _WATCHED, 0), _WATCHED)
        bodies[size - last :] = np.arange(last)  # the first ones once more: one run shows both ends
        rows = np.flatnonzero(bodies < _WATCHED)
        expected = [alone[body] for body in bodies[rows]]
        batch = data.rows(bodies)
        ways = (one_by_one, at_once, uneven) if size <= together else (one_by_one,)
        if any(_row_bits(model, batch, cuts, rows) != expected for cuts in ways):
            return False
    return True


def _row_bits(
    model: Model, data: _Frames, cuts: Sequence[int], rows: Sequence[int] | npt.NDArray[np.intp]
) -> list[tuple[bytes, ...]]:
    """Everything some rows give, as bytes, when their frames are run in calls of the lengths `cuts`."""
    states = model.zero_states(len(data.mask))
    estimates: list[Floats] = []
    start = 0
    for length in cuts:
        outputs = model.run(*data.times(start, start + length), states)
        states, start = outputs.states, start + length
        estimates.append(np.concatenate([outputs.intensity[..., None], outputs.intensity_by_emotion], -1))
    results = [np.concatenate(estimates, 1), *states.values()]
    return list(zip(*([row.tobytes() for row in result[rows]] for result in results), strict=True))
