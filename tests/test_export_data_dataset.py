"""Data sets as a whole: every kind of source, all faults at once, leaks, determinism, and honesty about what it is."""

from pathlib import Path

import pytest

import datasets
from datasets import EBMDB_TABLE, ebmdb_rows, takes, write_bvh, write_ebmdb, write_manifest, write_table, write_tags
from fervor.errors import DataError
from fervor.skeletons.rig import mirror_pose
from fervor_export.clip import digest
from fervor_export.data.augment import augment
from fervor_export.data.dataset import Dataset, check_dataset, load_dataset
from fervor_export.evaluation.splits import assert_disjoint, by_recording


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's cache, in a folder of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def said(data: Dataset, severity: str = "unusable") -> list[str]:
    return [str(finding) for finding in data.findings if finding.severity == severity]


def test_the_first_layout(tmp_path: Path) -> None:
    made = takes(12)
    write_ebmdb(tmp_path / "data", made)
    data = load_dataset(tmp_path / "data")
    assert not data.findings
    assert (data.kind, data.purpose) == ("ebmdb", "research")
    for clip, take in zip(data.clips, made, strict=True):
        assert (clip.name, clip.actor, clip.emotion, clip.observers) == (take.name, take.actor, take.emotion, 11)
        assert clip.intensity == take.votes / 11
        assert clip.frames == 45
        assert len(clip.phases) == 3
    assert all(take.motion.t_poses == 1 for take in data.takes)
    assert [clip.emotion for clip in data.neutral] == ["neutral"]
    assert len(data.intense) == 11
    assert "12 clips of 2 actors" in data.description


def test_the_second_layout_from_two_kinds_of_files(tmp_path: Path) -> None:
    made = takes(4)
    write_tags(tmp_path, made, responses=True, mvnx=(1, 2))
    data = load_dataset(tmp_path)
    assert [clip.intensity for clip in data.clips] == [take.votes / 11 for take in made]
    assert {take.motion.skeleton[:4] for take in data.takes} == {"BVH ", "Xsen"}
    assert [take.motion.t_poses for take in data.takes] == [1, 0, 0, 1]


def test_a_second_layout_without_labels_says_what_is_missing(tmp_path: Path) -> None:
    write_tags(tmp_path, takes(2))
    with pytest.raises(DataError, match=r"no answers of observers.*responses\.csv"):
        load_dataset(tmp_path)
    data = check_dataset(tmp_path)
    assert not data.clips
    assert len(data.takes) == 2


def manifest_of_all_kinds(folder: Path) -> Path:
    write_bvh(folder / "ann" / "1.bvh", datasets.motion(seed=1))
    datasets.write_mvnx(folder / "ann" / "2.mvnx", datasets.motion(seed=2))
    datasets.write_npz(folder / "ben" / "3.npz", datasets.motion(seed=3, rate_hz=60.0))
    datasets.write_positions(folder / "ben" / "4.csv", datasets.motion(seed=4, seconds=3.0, rate_hz=30.0))
    rows = [
        {"file": "ann/1.bvh", "emotion": "joy", "votes": "7/11", "actor": "Ann", "split": "train"},
        {"file": "ann/2.mvnx", "emotion": "anger", "intensity": "0.25", "actor": "Ann", "split": "train"},
        {"file": "ben/3.npz", "emotion": "happy", "votes": "1/5", "actor": "Ben", "split": "test"},
        {"file": "ben/4.csv", "emotion": "pride", "votes": "2/5", "actor": "Ben", "split": "test", "end": 1.5},
        {"file": "ben/4.csv", "emotion": "fear", "votes": "3/5", "actor": "Ben", "split": "test", "start": 1.5},
    ]
    return write_manifest(folder, [row | {"skeleton": "mediapipe" if "4" in row["file"] else ""} for row in rows])


def test_a_manifest_over_every_kind_of_file(tmp_path: Path) -> None:
    manifest = manifest_of_all_kinds(tmp_path)
    data = load_dataset(manifest)
    assert not data.findings
    assert [clip.emotion for clip in data.clips] == ["joy", "anger", "joy", "pride", "fear"]
    assert [clip.observers for clip in data.clips] == [11, None, 5, 5, 5]
    assert [len(clip.phases) for clip in data.clips] == [3, 3, 1, 0, 0]
    assert data.clips[3].name == data.clips[4].name == "ben/4"
    assert {split: len(clips) for split, clips in data.splits.items()} == {"train": 2, "test": 3}
    assert load_dataset(tmp_path).sha256 == data.sha256


def test_everything_wrong_with_a_manifest_is_told_at_once(tmp_path: Path) -> None:
    manifest = manifest_of_all_kinds(tmp_path)
    (tmp_path / "ann" / "1.bvh").write_text("HIERARCHY\nbroken")
    (tmp_path / "ben" / "3.npz").unlink()
    text = manifest.read_text().replace("2/5", "6/5").replace("1.5,\n", "9.5,\n")
    manifest.write_text(text)
    with pytest.raises(DataError) as raised:
        load_dataset(manifest)
    assert "\n" not in raised.value.message
    assert "3 problems" in raised.value.message
    notes = raised.value.__notes__
    for line, what in (("line 2", "line 2: "), ("line 4", "there is no file"), ("line 5", "votes are 6/5")):
        assert any(note.startswith(line) and what in note for note in notes), line
    data = check_dataset(manifest)
    assert [str(finding) for finding in data.unusable] == notes
    assert len(data.clips) == 2


def test_findings_are_in_the_order_of_the_lines(tmp_path: Path) -> None:
    manifest = manifest_of_all_kinds(tmp_path)
    (tmp_path / "ann" / "1.bvh").write_text("HIERARCHY\nbroken")
    manifest.write_text(manifest.read_text().replace("1/5", "9/5").replace("anger", "envy"))
    found = [str(finding) for finding in check_dataset(manifest).unusable]
    assert [one.partition(" (")[0] for one in found] == ["line 2", "line 3", "line 4"]
    assert found[0].startswith("line 2 (ann/1.bvh): 1.bvh, line 2: ")


def test_every_planted_fault_of_the_first_layout_is_told_and_the_rest_is_used(tmp_path: Path) -> None:
    made = takes(8)
    rows = write_ebmdb(tmp_path, made)
    files = [tmp_path / "bvh" / f"{take.name}.bvh" for take in made]
    files[0].write_text(files[0].read_text()[:-2000])
    files[1].unlink()
    rows[2]["responses"] = " "
    write_bvh(files[3], made[3].motion()[:40])
    write_bvh(files[4], made[4].motion()[:120], t_poses=0)
    write_bvh(files[5], made[5].motion(rate_hz=60.0), rate_hz=60.0)
    write_table(tmp_path / EBMDB_TABLE, rows)
    data = load_dataset(tmp_path)
    found = said(data)
    assert len(found) == 4
    for take, what in zip(made, ("frames", "no file", "no responses", "too short"), strict=False):
        assert any(take.name in one and what in one for one in found), what
    doubts = said(data, "doubt")
    assert any(made[4].name in doubt and "its name says 1.5" in doubt for doubt in doubts)
    assert any(made[5].name in doubt and "60.0 frames a second" in doubt for doubt in doubts)
    assert [clip.name for clip in data.clips] == [take.name for take in made[4:]]


def test_the_same_motion_twice_is_one_recording_or_left_out(tmp_path: Path) -> None:
    made = takes(6, actors=("AnBh", "DiMi", "HeGa"))
    copies = takes(6, actors=("AnBh", "HeGa", "HeGa"), seed=1)[:3]  # AnBh, HeGa, HeGa
    write_ebmdb(tmp_path, made)
    first, second, third = (made[place].motion() for place in (0, 1, 2))
    write_bvh(tmp_path / "bvh" / f"{copies[0].name}_x.bvh", mirror_pose(first, first[..., 0] < 2)[0])
    write_bvh(tmp_path / "bvh" / f"{copies[1].name}_x.bvh", second)
    write_bvh(tmp_path / "bvh" / f"{copies[2].name}_x.bvh", third[20:])
    extra = [row | {"motion_id": f"{row['motion_id']}_x"} for row in ebmdb_rows(copies)]
    write_table(tmp_path / EBMDB_TABLE, [*ebmdb_rows(made), *extra])
    data = load_dataset(tmp_path)
    assert len(said(data)) == 1
    assert data.notes == (
        "Rows and files left out, as they can't be used: 1; `fervor data check` lists them.",
        "Recordings left out, as they repeat one of another actor or split: 1.",
    )
    assert "actor DiMi" in said(data)[0]
    assert "a leak" in said(data)[0]
    assert [clip.name for clip in data.clips[6:]] == [made[0].name, made[2].name]
    doubts = said(data, "doubt")
    assert any("a mirror image of the same motion" in doubt for doubt in doubts)
    for fold in by_recording(data.clips, folds=3):
        train = augment([data.clips[place] for place in fold.train])
        assert_disjoint(train, [data.clips[place] for place in fold.test])


def test_loading_repeats_itself_whatever_was_kept(tmp_path: Path, cache: Path) -> None:
    write_ebmdb(tmp_path / "data", takes(4))
    cold, warm = load_dataset(tmp_path / "data"), load_dataset(tmp_path / "data")
    assert list(cache.rglob("*.npz"))
    assert cold.sha256 == warm.sha256 == digest(cold.clips)
    apart = load_dataset(tmp_path / "data", cache=tmp_path / "other", processes=1)
    assert apart.sha256 == cold.sha256
    assert digest(augment(apart.clips)) == digest(augment(warm.clips))


def test_a_changed_file_or_label_is_another_data_set(tmp_path: Path) -> None:
    made = takes(3)
    rows = write_ebmdb(tmp_path, made)
    before = load_dataset(tmp_path).sha256
    rows[0]["responses"] = rows[0]["responses"].replace(made[0].emotion, "shame", 1) + " shame"
    write_table(tmp_path / EBMDB_TABLE, rows)
    between = load_dataset(tmp_path).sha256
    write_bvh(tmp_path / "bvh" / f"{made[1].name}.bvh", datasets.motion(seed=77))
    assert len({before, between, load_dataset(tmp_path).sha256}) == 3


def test_generated_motion_says_that_it_is_generated() -> None:
    data = load_dataset("synthetic", clips=5, seed=3)
    assert (data.kind, data.purpose, len(data.clips)) == ("synthetic", "demo", 5)
    assert "no recordings of people" in data.description
    assert load_dataset("synthetic", clips=5, seed=3).sha256 == data.sha256
    assert load_dataset("synthetic", clips=5, seed=4).sha256 != data.sha256
    assert all(clip.observers for clip in load_dataset("synthetic", clips=3, votes=True).clips)


def test_a_layout_is_not_taken_for_the_data_themselves(tmp_path: Path) -> None:
    write_ebmdb(tmp_path, takes(2))
    assert load_dataset(tmp_path).description.startswith("motion in EBMDB's layout")


def test_what_is_no_data_set_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="neither a folder nor a manifest"):
        load_dataset(tmp_path / "absent")
    with pytest.raises(DataError, match="no data set"):
        load_dataset(tmp_path)
    (tmp_path / "notes.csv").write_text("a,b\n1,2\n")
    with pytest.raises(DataError, match="no column file"):
        load_dataset(tmp_path / "notes.csv")


def test_real_motion_is_read_whole(shared_data: Path, tmp_path: Path) -> None:
    files = sorted(shared_data.rglob("*.bvh"))
    rows = [{"file": str(file), "emotion": "joy", "votes": "5/10", "actor": file.parent.name} for file in files]
    data = load_dataset(write_manifest(tmp_path, rows))
    assert len(data.clips) == len(files) > 4
    assert not [doubt for doubt in said(data, "doubt") if "seen" in doubt or "moves" in doubt]
    assert {round(take.motion.rate_hz): len(take.motion.phases) for take in data.takes} == {60: 2, 120: 4}
    assert {take.entry.actor: take.motion.t_poses for take in data.takes} == {"100style": 0, "cmu": 1}
    assert {clip.name for clip in data.clips} == {str(file.with_suffix("")) for file in files}
