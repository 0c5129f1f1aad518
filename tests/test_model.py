"""The model file at run time: what is loaded, what is refused, and that nothing prints."""

import hashlib
import inspect
import os
import re
import subprocess
import sys

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

import fervor.model
from fervor.emotions import EMOTIONS
from fervor.engine import engine
from fervor.errors import EngineError, ModelFileError
from fervor.metadata import METADATA_KEY, StateTensor
from fervor.model import Model, check_row_independence, default_model_path
from fervor.scoring import sequences
from fervor.session.lanes import LANES
from fervor.skeletons.rig import JOINTS, PARENTS
from fervor_export.graph import build_model
from networks import DEFAULT, frames, metadata, model_bytes, network


@pytest.fixture(scope="module")
def model() -> Model:
    return Model.load(model_bytes())


def test_what_a_model_says_of_itself(model):
    assert model.metadata == metadata()
    assert model.sha256 == hashlib.sha256(model_bytes()).hexdigest()
    assert re.fullmatch(r"[0-9a-f]{16}", model.fingerprint)
    assert model.fingerprint == Model.load(model_bytes()).fingerprint


def test_another_file_runtime_or_cpu_has_another_fingerprint(model, monkeypatch):
    other = build_model(network(seed=1), metadata()).SerializeToString()
    assert Model.load(other).fingerprint != model.fingerprint
    with monkeypatch.context() as changed:
        changed.setattr(fervor.model.onnxruntime, "__version__", "0.0.1")
        assert Model.load(model_bytes()).fingerprint != model.fingerprint
    monkeypatch.setattr(fervor.model, "_cpu_features", lambda: ["none"])
    assert Model.load(model_bytes()).fingerprint != model.fingerprint


def test_path_and_content_are_the_same(model, tmp_path):
    path = tmp_path / "model.onnx"
    path.write_bytes(model_bytes())
    assert Model.load(path).sha256 == Model.load(str(path)).sha256 == model.sha256


def test_run_gives_what_zero_states_takes(model):
    states = model.zero_states(3)
    assert {name: state.shape for name, state in states.items()} == {
        "h1": (3, 64), "c1": (3, 64), "h2": (3, 128), "c2": (3, 128), "previous": (3, 13, 4),
    }  # fmt: skip
    outputs = model.run(*frames(3, 4), states)
    assert outputs.intensity.shape == (3, 4)
    assert outputs.intensity_by_emotion.shape == (3, 4, 11)
    assert {name: (state.shape, state.dtype) for name, state in outputs.states.items()} == {
        name: (state.shape, state.dtype) for name, state in states.items()
    }
    assert not any(state.any() for state in states.values())  # what went in is as it was


def test_states_are_told_apart_by_name(model):
    data, states = frames(1, 1), model.zero_states(1)
    ones = {**states, "h1": np.ones_like(states["h1"])}
    mixed = {**states, "c1": np.ones_like(states["c1"])}
    assert model.run(*data, ones).intensity != model.run(*data, mixed).intensity
    backwards = dict(reversed(list(ones.items())))
    assert model.run(*data, ones).intensity == model.run(*data, backwards).intensity


def test_a_failing_run_is_our_fault(model):
    rotations, mask, emotion = frames(2, 1)
    with pytest.raises(EngineError, match="model test failed to run: "):
        model.run(rotations, mask[:1], emotion, model.zero_states(2))
    with pytest.raises(EngineError, match="model test failed to run: "):
        model.run(rotations[..., :3], mask, emotion, model.zero_states(2))
    model.run(rotations, mask, emotion, model.zero_states(2))  # and the next one runs


def test_the_packaged_model_is_a_small_demo():
    packaged = Model.load(default_model_path())
    assert packaged.metadata.purpose == "demo"
    assert packaged.metadata.name == "fervor-demo"
    assert default_model_path().stat().st_size < 2_000_000
    assert check_row_independence(packaged) == 1


# --- refusals -------------------------------------------------------------------------------------------------------


def refusal(content) -> str:
    with pytest.raises(ModelFileError) as caught:
        Model.load(content)
    message = caught.value.message
    assert "\n" not in message
    assert message.startswith("the model ")
    return message


def changed_metadata(**changes) -> bytes:
    return build_model(network(), metadata(**changes)).SerializeToString()


def changed_graph(change) -> bytes:
    proto = build_model(network(), metadata())
    change(proto)
    return proto.SerializeToString()


def value(container, name):
    return next(entry for entry in container if entry.name == name)


def test_no_file(tmp_path):
    with pytest.raises(ModelFileError, match=r"absent\.onnx can't be read as a model file: No such file or directory"):
        Model.load(tmp_path / "absent.onnx")
    with pytest.raises(ModelFileError, match="can't be read as a model file: Is a directory"):
        Model.load(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not onnx", b"\x08\x07" * 40, b"PK\x03\x04zip"])
def test_not_onnx(content):
    assert "is not an ONNX file that onnxruntime can run" in refusal(content)


def test_cut_short():
    assert "is not an ONNX file that onnxruntime can run" in refusal(model_bytes()[:-1000])


def test_onnx_of_something_else():
    tensor = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1]) for name in "ab"]
    graph = helper.make_graph([helper.make_node("Neg", ["a"], ["b"])], "other", tensor[:1], tensor[1:])
    other = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    assert refusal(other.SerializeToString()) == "the model is not a fervor model: its metadata has no 'fervor' entry"


def test_another_contract():
    def change(proto):
        entry = next(entry for entry in proto.metadata_props if entry.key == METADATA_KEY)
        entry.value = entry.value.replace('"metadata_version":1', '"metadata_version":2')

    assert "metadata this service can't use: metadata_version" in refusal(changed_graph(change))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"joints": ("pelvis", *JOINTS[1:])}, "rig joints pelvis, chest"),
        ({"joints": JOINTS[:-1]}, f"this service expects {', '.join(JOINTS)}"),
        ({"parents": (0, *PARENTS[1:])}, "joint parents 0, 0, 1"),
        ({"emotions": EMOTIONS[::-1]}, "emotions surprise, shame"),
        ({"emotions": ()}, "emotions (none)"),
        ({"states": DEFAULT.states[:-1]}, "has an unknown input previous"),
        ({"states": (*DEFAULT.states, StateTensor(name="h3", shape=(4,)))}, "lacks input h3"),
        (
            {"states": (*DEFAULT.states[:-1], StateTensor(name="previous", shape=(12, 4)))},
            "has input previous of shape [any, 13, 4]; expected [any, 12, 4]",
        ),
    ],
)
def test_metadata_that_differ_from_us_or_from_the_graph(changes, told):
    assert told in refusal(changed_metadata(**changes))


def test_lacking_and_unknown_outputs():
    def drop(proto):
        proto.graph.output.remove(value(proto.graph.output, "intensity_by_emotion"))

    def add(proto):
        proto.graph.output.append(helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["batch", "time", 16]))

    assert refusal(changed_graph(drop)) == "the model lacks output intensity_by_emotion"
    assert refusal(changed_graph(add)) == "the model has an unknown output logits"


def test_wrong_types():
    def change(proto):
        value(proto.graph.input, "mask").type.tensor_type.elem_type = TensorProto.DOUBLE
        proto.graph.node.insert(0, helper.make_node("Cast", ["mask"], ["mask.single"], to=TensorProto.FLOAT))
        for node in proto.graph.node[1:]:
            node.input[:] = ["mask.single" if name == "mask" else name for name in node.input]

    assert refusal(changed_graph(change)) == "the model has input mask of type tensor(double); expected tensor(float)"


def test_fixed_axes():
    def change(proto):
        for name in ("rotations", "mask", "emotion"):
            value(proto.graph.input, name).type.tensor_type.shape.dim[1].dim_value = 1

    assert "has input rotations of shape [any, 1, 13, 4]; expected [any, any, 13, 4]" in refusal(changed_graph(change))


def test_numbers_that_are_not_finite():
    def change(proto):
        value(proto.graph.node, "intensities").op_type = "Log"

    assert refusal(changed_graph(change)) == ("the model gives numbers in intensity that are not finite on a test step")


def test_states_that_are_not_finite():
    def change(proto):
        value(proto.graph.node, "next_c1").op_type = "Log"

    assert re.search(r"gives numbers in next_[hc]1 that are not finite on a test step$", refusal(changed_graph(change)))


def test_intensities_out_of_range():
    def change(proto):
        value(proto.graph.node, "intensities").op_type = "Exp"

    assert re.search(r"gives numbers in intensity\w* outside 0 to 1 on a test step$", refusal(changed_graph(change)))


def test_a_graph_that_fails_when_it_runs():
    def change(proto):
        value(proto.graph.initializer, "last").CopyFrom(numpy_helper.from_array(np.asarray(5), "last"))

    assert "the model fails on a test step: model test failed to run: " in refusal(changed_graph(change))


def test_refusals_and_runs_print_nothing(tmp_path):
    (tmp_path / "good.onnx").write_bytes(model_bytes())
    (tmp_path / "bad.onnx").write_bytes(model_bytes()[:-1000])
    program = """
import sys
from fervor.errors import EngineError, ModelFileError
from fervor.model import Model
for name in ("bad.onnx", "absent.onnx"):
    try:
        Model.load(name)
    except ModelFileError:
        pass
model = Model.load("good.onnx")
try:
    model.run(*[model.zero_states(1)["previous"]] * 3, model.zero_states(2))
except EngineError:
    pass
assert not {"torch", "onnx", "scipy", "sklearn", "fervor_export"} & sys.modules.keys()
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


# --- row independence -----------------------------------------------------------------------------------------------


class Leaky:
    """A model whose rows feel their neighbours unless batches are multiples of `safe`."""

    def __init__(self, model: Model, *, safe: int | None) -> None:
        self.model, self.safe = model, safe
        self.metadata, self.zero_states = model.metadata, model.zero_states

    def run(self, rotations, mask, emotion, states):
        outputs = self.model.run(rotations, mask, emotion, states)
        batch = len(rotations)
        if self.safe is None or batch % self.safe:
            outputs.intensity[:] += np.float32(1e-7) * batch
        return outputs


def test_rows_are_independent_here(model):
    assert check_row_independence(model) == 1


@pytest.mark.parametrize("safe", [2, 4, 16])
def test_the_smallest_safe_multiple_is_found(model, safe):
    assert check_row_independence(Leaky(model, safe=safe)) == safe


def test_no_safe_multiple_is_an_error(model):
    with pytest.raises(EngineError, match="depend on the batch in their last bits"):
        check_row_independence(Leaky(model, safe=None))


def test_states_that_differ_are_seen_too(model):
    class Drifting(Leaky):
        def run(self, rotations, mask, emotion, states):
            outputs = self.model.run(rotations, mask, emotion, states)
            if rotations.shape[1] > 1:
                outputs.states["c2"][:] += np.float32(1e-6)
            return outputs

    with pytest.raises(EngineError):
        check_row_independence(Drifting(model, safe=None))


class Odd:
    """A model one of whose rows differs, in calls of one shape only."""

    def __init__(self, model: Model, size: int, row: int, time: int) -> None:
        self.model, self.shape, self.row = model, (size, time), row
        self.metadata, self.zero_states = model.metadata, model.zero_states

    def run(self, rotations, mask, emotion, states):
        outputs = self.model.run(rotations, mask, emotion, states)
        if rotations.shape[:2] == self.shape:
            outputs.states["h2"][self.row, 7] += np.float32(1e-6)
        return outputs


@pytest.mark.parametrize(("size", "row", "time"), [(5, 0, 1), (33, -1, 1), (33, -1, 3), (33, 11, 5)])
def test_one_row_that_differs_is_seen(model, size, row, time):
    assert check_row_independence(Odd(model, size, row, time)) == 2, "the sizes that are left are even"


@pytest.mark.parametrize(("size", "row", "time"), [(48, -12, 2), (256, -12, 1), (256, 0, 1)])
def test_one_row_that_differs_in_a_multiple_of_all_is_seen(model, size, row, time):
    with pytest.raises(EngineError):
        check_row_independence(Odd(model, size, row, time))


def test_the_proof_covers_the_batches_that_are_run():
    covered = {name: of.default for name, of in inspect.signature(check_row_independence).parameters.items()}
    assert covered["largest"] == engine.MOST_STEPS * LANES
    assert covered["together"] >= sequences.MOST_ROWS


def test_onnx_itself_finds_nothing_wrong():
    onnx.checker.check_model(onnx.load_from_string(model_bytes()), full_check=True)


def test_onnxruntime_reports_to_nobody(tmp_path):
    """Its telemetry, on by default since 1.29, leaves a device id in the home folder when it runs."""
    code = "from fervor.model import Model, default_model_path; Model.load(default_model_path())"
    environment = {"HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache"), "PATH": os.environ["PATH"]}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    assert list(tmp_path.rglob("*")) == []
