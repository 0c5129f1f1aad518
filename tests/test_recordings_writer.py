"""Files hold canonical rotations, and give them back."""

import os
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings.bvh import read_bvh
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.writer import bvh_of, write_recording
from fervor.skeletons.catalog import skeleton

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.exists() and not os.environ.get("CI"), reason="no real motion here")


def make(times: npt.ArrayLike | None = None, *, source: str = "c13", gaps: bool = False, seed: int = 0) -> Recording:
    known = skeleton(source)
    stamps = np.arange(30) / 120 if times is None else np.asarray(times, np.float64)
    count = len(known.joints)
    turns = Rotation.random(len(stamps) * count, random_state=seed).as_quat().reshape(len(stamps), count, 4)
    observed = np.random.default_rng(seed).random((len(stamps), count)) > (0.2 if gaps else -1)
    return Recording("take", known, stamps, turns, observed, known.axes)


def apart(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    return float((Rotation.from_quat(a.reshape(-1, 4)).inv() * Rotation.from_quat(b.reshape(-1, 4))).magnitude().max())


@pytest.mark.parametrize("suffix", ["csv", "jsonl", "ndjson", "npz"])
@pytest.mark.parametrize("source", ["c13", "kinect_v2", "nite", "xsens_mvn"])
def test_tables_keep_every_bit_and_gap(tmp_path: Path, suffix: str, source: str) -> None:
    recording = make([0, 0.03, 0.1, 0.5, 0.51], source=source, gaps=True)
    times, local, observed = rig_poses(recording)
    path = tmp_path / f"take.{suffix}"
    write_recording(recording, path)
    again = read_recording(path)
    assert again.skeleton is skeleton("c13")
    assert again.name == "take"
    assert np.array_equal(again.times, times)
    assert np.array_equal(again.observed, observed)
    assert np.array_equal(again.rotations[observed], local[observed])


@pytest.mark.parametrize("source", ["c13", "kinect_v2", "xsens_mvn", "cmu"])
def test_bvh_gives_the_rotations_back(tmp_path: Path, source: str) -> None:
    recording = make(source=source)
    write_recording(recording, str(tmp_path / "take.bvh"))
    again = read_bvh(tmp_path / "take.bvh")
    assert "zero pose N" in again.skeleton.title
    assert again.rate_hz == pytest.approx(120)
    times, local, observed = rig_poses(again)
    assert observed.all()
    assert apart(local, rig_poses(recording)[1]) < 1e-9
    assert np.allclose(times, recording.times, atol=1e-7)


def test_bvh_holds_unobserved_joints() -> None:
    recording = make()
    recording.observed[10:15, 4] = False
    recording.observed[:3, 5] = False
    _, local, _ = rig_poses(recording)
    again = rig_poses(read_bvh_text(bvh_of(recording)))[1]
    assert apart(again[10:15, 4], np.repeat(local[9:10, 4], 5, axis=0)) < 1e-9
    assert apart(again[:3, 5], np.tile([0.0, 0, 0, 1], (3, 1))) < 1e-9


def read_bvh_text(text: str) -> Recording:
    import io

    return read_bvh(io.StringIO(text), name="take")


def test_bvh_puts_frames_on_an_even_grid() -> None:
    """A joint that turns evenly, seen at uneven times, turns evenly in the file."""
    times = np.sort(np.concatenate([[0.0, 3.0], np.random.default_rng(0).uniform(0, 3, 100)]))
    turns = np.tile([0.0, 0, 0, 1], (len(times), 13, 1))
    turns[:, 4] = Rotation.from_rotvec(np.outer(times, [0.5, 0, 0])).as_quat()
    recording = Recording("take", skeleton("c13"), times, turns, np.ones((len(times), 13), np.bool_), "local")
    again = read_bvh_text(bvh_of(recording))
    assert again.duration_s == pytest.approx(3.0, abs=1 / again.rate_hz)
    expected = Rotation.from_rotvec(np.outer(again.times, [0.5, 0, 0])).as_quat()
    assert apart(rig_poses(again)[1][:, 4], expected) < 1e-6


def test_a_single_frame_can_be_written() -> None:
    assert len(read_bvh_text(bvh_of(make([0.0])))) == 1


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"can't write \.fbx; expected csv, jsonl, npz, bvh"):
        write_recording(make(), tmp_path / "take.fbx")
    with pytest.raises(RecordingError, match="can't write a file without suffix"):
        write_recording(make(), tmp_path / "take")
    with pytest.raises(RecordingError, match="can't be written: No such file"):
        write_recording(make(), tmp_path / "nowhere" / "take.csv")
    empty = Recording("none", skeleton("c13"), np.zeros(0), np.zeros((0, 13, 4)), np.zeros((0, 13), np.bool_), "local")
    with pytest.raises(RecordingError, match="none: there is no frame"):
        bvh_of(empty)
    assert (empty.rate_hz, empty.duration_s, len(empty)) == (0.0, 0.0, 0)


@needs_data
@pytest.mark.parametrize("file", ["100style/elated_reference", "cmu/79_69"])
@pytest.mark.parametrize("suffix", ["bvh", "csv", "jsonl", "npz"])
def test_real_motion_survives_a_conversion(tmp_path: Path, file: str, suffix: str) -> None:
    recording = read_bvh(DATA / f"{file}.bvh")
    path = tmp_path / f"motion.{suffix}"
    write_recording(recording, path)
    again = read_recording(path)
    assert len(again) == len(recording)
    assert apart(rig_poses(again)[1], rig_poses(recording)[1]) < 1e-9
