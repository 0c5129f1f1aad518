"""Recordings as NPZ."""

import io
import zipfile
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings import table_npz
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content
from fervor.recordings.table_npz import npz_of, parse_npz

ROTATIONS = Rotation.random(4 * 13, random_state=0).as_quat().reshape(4, 13, 4)


def packed(**arrays: Any) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def read(data: bytes, skeleton: str | None = None) -> Recording:
    return parse_npz(Content(data, "take.npz", "take"), skeleton)


def test_arrays_are_found_by_name() -> None:
    observed = np.ones((4, 13), np.bool_)
    observed[2, 3] = False
    data = packed(
        rotations=np.roll(ROTATIONS, 1, axis=-1).astype(np.float32),
        times=np.array([1, 2, 3, 5]),
        observed=observed.astype(np.uint8),
        skeleton="c13",
        axes="local",
        quaternion="wxyz",
        comment=np.array(["whatever"]),
    )
    recording = read(data)
    assert recording.skeleton.name == "c13"
    assert np.array_equal(recording.rotations[observed], ROTATIONS.astype(np.float32)[observed])
    assert np.array_equal(recording.times, [0, 1, 2, 4])
    assert np.array_equal(recording.observed, observed)


def test_joint_names_rate_and_positions() -> None:
    assert read(packed(rotations=ROTATIONS[:, :2], rate_hz=10, joints=["head", "chest"]), "c13").observed.sum() == 8
    positions = np.random.default_rng(0).normal(size=(4, 33, 3))
    assert read(packed(positions=positions, rate_hz=np.array([30.0]), skeleton="mediapipe")).observed.any()


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "not an NPZ file that can be read"),
        (b"PK\x03\x04 nonsense", "not an NPZ file that can be read"),
        (packed(rotations=ROTATIONS, rate_hz=1)[:-40], "not an NPZ file that can be read"),
        (packed(other=ROTATIONS), "expected either 'rotations' or 'positions' among its arrays"),
        (packed(rotations=ROTATIONS, positions=ROTATIONS[..., :3]), "expected either 'rotations' or 'positions'"),
        (packed(rotations=np.array(["a"])), "the array 'rotations' holds <U1; expected numbers"),
        (packed(rotations=ROTATIONS, rate_hz=1, times=["a"]), "the array 'times' holds <U1; expected numbers"),
        (packed(rotations=ROTATIONS[..., :3], rate_hz=1), "have the shape [4, 13, 3]; expected [frame, joint, 4]"),
        (packed(positions=ROTATIONS, rate_hz=1), "have the shape [4, 13, 4]; expected [frame, joint, 3]"),
        (packed(rotations=np.float64(1.0), rate_hz=1), "have the shape []; expected [frame, joint, 4]"),
        (packed(rotations=np.array([{"a": 1}], object)), "not an NPZ file that can be read (Object arrays cannot"),
        (packed(rotations=ROTATIONS), "neither times nor a rate_hz over 0"),
        (packed(rotations=ROTATIONS, rate_hz=[1, 2]), "neither times nor a rate_hz over 0"),
    ],
)
def test_a_broken_file_is_refused(data: bytes, sentence: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(data, "c13")
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take.npz: ")


def test_an_array_that_claims_to_be_huge_is_refused() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive, archive.open("rotations.npy", "w") as member:
        np.lib.format.write_array_header_1_0(
            member, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 13, 4)}  # type: ignore[arg-type]
        )  # fmt: skip
    with pytest.raises(RecordingError, match="not an NPZ file that can be read"):
        read(out.getvalue())


def test_a_file_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_npz, "MOST_BYTES", 1 << 20)
    out = io.BytesIO()
    np.savez_compressed(out, rotations=np.zeros((1 << 15, 2, 4)), rate_hz=1)
    assert len(out.getvalue()) < 1 << 14
    with pytest.raises(RecordingError, match="the arrays unpack to more than 1 MiB"):
        read(out.getvalue())


def test_what_is_written_can_be_read() -> None:
    recording = read(packed(rotations=ROTATIONS, rate_hz=7), "c13")
    again = read(npz_of(recording))
    assert np.allclose(again.rotations, recording.rotations, atol=1e-15)
    assert np.array_equal(again.times, recording.times)
