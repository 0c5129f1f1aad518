"""`fervor convert`: from any kind of recording to any other, at any rate, and what was lost is told."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import motion
from fervor.cli.convert import at_rate
from fervor.cli.main import run
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.recordings.bvh import read_bvh
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import Recording, rig_poses
from fervor.rotations import angle_between
from fervor.skeletons.canonical import C13
from fervor.skeletons.catalog import skeleton
from program import write_bvh
from sensors import rendered


@pytest.fixture
def wave(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording in the folder that commands work in."""
    monkeypatch.chdir(tmp_path)
    return write_bvh(tmp_path / "wave.bvh", seconds=1.0)


def canonical(frames: int, *, rate: float = 30.0, holes: float = 0.0, seed: int = 0) -> Recording:
    rotations = motion(frames, seed=seed, speed=0.02)
    observed = np.random.default_rng(seed).random((frames, 13)) >= holes
    return Recording("walk", C13, np.arange(frames) / rate, rotations, observed, "local")


def difference(one: Recording, other: Recording) -> float:
    """Largest angle between the observed joints of two recordings, degrees; they observe the same."""
    (_, a, seen), (_, b, seen_too) = rig_poses(one), rig_poses(other)
    assert np.array_equal(seen, seen_too)
    return float(np.degrees(angle_between(a, b)[seen].max()))


@pytest.mark.parametrize("suffix", ["bvh", "csv", "jsonl", "npz"])
def test_the_motion_survives(suffix: str, wave: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = wave.with_name(f"other.{suffix}")
    assert run(["convert", str(wave), str(out)]) == 0
    before, after = read_bvh(wave), read_recording(out)
    assert np.allclose(after.times, before.times, atol=1e-6)
    assert difference(before, after) < 1e-6
    told = capsys.readouterr()
    assert told.out == f"{out}: 61 frames in 1.0 s at 60 Hz; all 13 joints seen\n"
    assert told.err == ""


def test_there_and_back_through_every_kind(wave: Path) -> None:
    steps = [wave, *(wave.with_name(f"step{number}.{kind}") for number, kind in enumerate(("csv", "npz", "jsonl")))]
    for source, target in itertools.pairwise(steps):
        assert run(["convert", str(source), str(target)]) == 0
    first, last = read_recording(steps[1]), read_recording(steps[-1])
    assert first.times.tolist() == last.times.tolist()
    assert np.abs(first.rotations - last.rotations).max() < 1e-12


def write_kinect(path: Path, name: str = "nite") -> Path:
    """A sensor that sees no wrists, a right elbow that is lost half of the time."""
    source = skeleton(name)
    sent = rendered(source, motion(20))
    lost = source.joints.index("RIGHT_ELBOW")
    lines = [json.dumps({"skeleton": name})]
    for number, pose in enumerate(sent.tolist()):
        q = [None if joint == lost and number % 2 else turn for joint, turn in enumerate(pose)]
        lines.append(json.dumps({"t": number / 30, "q": q}))
    path.write_text("\n".join(lines))
    return path


def test_what_was_not_seen_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write_kinect(tmp_path / "nite.jsonl")
    assert run(["convert", str(source), str(tmp_path / "out.csv")]) == 0
    said = capsys.readouterr().out
    assert "never seen: spine, chest, l_wrist, r_wrist, l_hip, r_hip; seen in part: r_elbow (50% of the time)" in said
    assert "BVH" not in said
    assert run(["convert", str(source), str(tmp_path / "out.bvh")]) == 0
    assert "they hold their last pose" in capsys.readouterr().out


def test_segments_name_the_joints_of_a_strange_tree(wave: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = {"LeftArm": "B7", "LeftForeArm": "B8", "RightArm": "B9", "RightForeArm": "B10"}
    text, plain = wave.read_text(), read_bvh(wave)
    for name, strange in names.items():
        text = text.replace(f"JOINT {name}\n", f"JOINT {strange}\n")
    wave.write_text(text)
    assert run(["convert", str(wave), "out.npz"]) == 65
    assert "name them with a map of segments" in capsys.readouterr().err
    limbs = ("l_uparm", "l_forearm", "r_uparm", "r_forearm")
    segments = wave.with_name("segments.json")
    segments.write_text(json.dumps(dict(zip(limbs, names.values(), strict=True)) | {"head": None}))
    out = wave.with_name("out.npz")
    assert run(["convert", str(wave), str(out), "--segments", str(segments)]) == 0
    assert "never seen: head" in capsys.readouterr().out
    blind = (*plain.skeleton.drives[:3], None, *plain.skeleton.drives[4:])
    assert difference(replace(plain, skeleton=replace(plain.skeleton, drives=blind)), read_recording(out)) < 1e-6


def test_a_skeleton_of_ones_own(tmp_path: Path) -> None:
    known = skeleton("smpl")
    spec = SkeletonSpec.of(known, name="lab").model_copy(update={"joints": tuple(f"J{k}" for k in range(24))})
    spec = spec.model_copy(
        update={"segments": {s: f"J{known.joints.index(j)}" for s, j in SkeletonSpec.of(known).segments.items()}}
    )
    (tmp_path / "lab.json").write_text(spec.model_dump_json())
    poses = motion(10)
    np.savez(tmp_path / "in.npz", rotations=rendered(known, poses, axes="local"), rate_hz=30.0)
    out = tmp_path / "out.npz"
    assert run(["convert", str(tmp_path / "in.npz"), str(out), "--skeleton", str(tmp_path / "lab.json")]) == 0
    assert angle_between(rig_poses(read_recording(out))[1], poses).max() < 1e-9


def test_another_skeleton_for_a_bvh_has_the_same_joints(wave: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = read_bvh(wave)
    lab, out = wave.with_name("lab.json"), wave.with_name("out.npz")
    lab.write_text(SkeletonSpec.of(recording.skeleton, name="lab").model_dump_json())
    assert run(["convert", str(wave), str(out), "--skeleton", str(lab)]) == 0
    assert difference(recording, read_recording(out)) < 1e-9
    lab.write_text(SkeletonSpec.of(skeleton("smpl"), name="lab").model_dump_json())
    assert run(["convert", str(wave), str(out), "--skeleton", str(lab)]) == 65
    assert "its joints are not those of skeleton 'lab'" in capsys.readouterr().err


@pytest.mark.parametrize("rate", [15, 30, 120])
def test_another_rate(rate: int, wave: Path) -> None:
    out = wave.with_name("out.csv")
    assert run(["convert", str(wave), str(out), "--rate", str(rate)]) == 0
    before, after = read_bvh(wave), read_recording(out)
    assert np.allclose(after.times, np.arange(rate + 1) / rate)
    shared = min(rate, 60)
    (_, a, _), (_, b, seen) = rig_poses(before), rig_poses(after)
    assert seen.all()
    assert angle_between(a[:: 60 // shared], b[:: rate // shared]).max() < np.radians(0.01)  # Frame Time has 7 digits


@settings(max_examples=50, deadline=None)
@given(
    st.integers(2, 30), st.sampled_from([15.0, 24.0, 50.0]), st.floats(1.0, 200.0), st.floats(0.0, 0.5), st.integers()
)
def test_a_resampled_recording_invents_nothing(
    frames: int, rate: float, wanted: float, holes: float, seed: int
) -> None:
    recording = canonical(frames, rate=rate, holes=holes, seed=abs(seed))
    made = at_rate(recording, wanted)
    assert np.allclose(np.diff(made.times), 1.0 / wanted)
    assert made.duration_s <= recording.duration_s + 1e-6
    assert recording.duration_s - made.duration_s < 1.0 / wanted
    _, local, seen = rig_poses(made)
    assert np.allclose(np.linalg.norm(local, axis=-1), 1.0)
    for time, mask in zip(made.times, seen, strict=True):
        near = np.abs(recording.times - time) < 1.0 / rate + 1e-9
        assert (recording.observed[near].any(axis=0) | ~mask).all()


def test_gaps_of_a_recording_stay_gaps_at_another_rate() -> None:
    recording = canonical(60)
    kept = np.r_[0:20, 24:40, 50:60]  # a gap of 5 steps, which a live body bridges, and one of 11, which it doesn't
    holed = replace(
        recording, times=recording.times[kept], rotations=recording.rotations[kept], observed=recording.observed[kept]
    )
    seen = at_rate(holed, 60.0).observed.all(axis=1)
    assert seen[:79].all()
    assert not seen[79:100].any()
    assert seen[100:].all()


@pytest.mark.parametrize(
    ("arguments", "exit_code", "sentence"),
    [
        (["absent.bvh", "out.csv"], 65, "absent.bvh: can't be read"),
        (["wave.bvh", "out.mvnx"], 65, "can't write .mvnx; expected csv, jsonl, npz, bvh"),
        (["wave.bvh", "folder/out.csv"], 65, "can't be written"),
        (["wave.bvh", "wave.bvh"], 65, "IN and OUT are the same file"),
        (["wave.bvh", "out.csv", "--skeleton", "smpl"], 65, "BVH files bring their own skeleton"),
        (["wave.bvh", "out.csv", "--skeleton", "absent.json"], 65, "absent.json: can't be read"),
        (["wave.bvh", "out.csv", "--skeleton", "list.json"], 65, "list.json: not a skeleton"),
        (["wave.bvh", "out.csv", "--segments", "list.json"], 65, "list.json: not a map of segments to joints"),
        (["wave.bvh", "out.csv", "--rate", "0"], 2, "--rate"),
    ],
)
def test_what_can_not_be_is_one_sentence(
    arguments: list[str],
    exit_code: int,
    sentence: str,
    wave: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (wave.parent / "list.json").write_text("[1]")
    before = wave.read_bytes()
    assert run(["convert", *arguments]) == exit_code
    told = capsys.readouterr()
    assert told.out == ""
    assert sentence in told.err
    assert exit_code == 2 or told.err.count("\n") == 1
    assert wave.read_bytes() == before
