"""What a run learns from: no actor on two sides, a manifest's own split kept."""

from datasets import motion, write_npz
from fervor_export.data.dataset import load_dataset
from fervor_export.material import Material, gather
from fervor_export.recipe import DEFAULT, PAPER


def manifest(folder, *, column=None):
    rows = ["file,emotion,intensity,actor" + (",split" if column else "")]
    for number in range(12):
        emotion = "neutral" if number % 6 == 5 else "joy"
        write_npz(folder / f"take{number}.npz", motion(seed=number, rate_hz=60.0))
        row = f"take{number}.npz,{emotion},{number / 12:.2f},actor {number % 4}"
        rows.append(row + (f",{column[number % 4]}" if column else ""))
    path = folder / "manifest.csv"
    path.write_text("\n".join(rows) + "\n")
    return str(path)


def actors(clips):
    return {clip.actor for clip in clips}


def test_no_actor_is_on_two_sides(tmp_path):
    for source in (manifest(tmp_path), "synthetic"):
        material = gather(source, DEFAULT, clips=300, seed=1)
        sides = [actors(part) for part in (material.learn, material.validate, material.test)]
        assert all(sides)
        assert len(set.union(*sides)) == sum(map(len, sides))
        assert len(material.seen) == len(material.learn) + len(material.validate)


def test_a_data_set_is_research_and_generated_motion_a_demo(tmp_path):
    material = gather(manifest(tmp_path), DEFAULT, clips=0, seed=0)
    assert material.purpose == "research"
    assert {clip.emotion for clip in [*material.seen, *material.test]} == {"joy", "neutral"}
    assert gather("synthetic", DEFAULT, clips=100, seed=0).purpose == "demo"


def test_a_recipe_that_keeps_the_last_epoch_learns_from_everybody_but_the_test(tmp_path):
    material = gather(manifest(tmp_path), PAPER, clips=0, seed=0)
    assert material.validate == []
    assert len(material.learn) + len(material.test) == 12
    own = gather(manifest(tmp_path, column=["train", "train", "validation", "test"]), PAPER, clips=0, seed=0)
    assert actors(own.learn) == {"actor 0", "actor 1", "actor 2"}
    assert actors(own.test) == {"actor 3"}


def test_a_whole_data_set_leaves_nobody_for_a_test(tmp_path):
    data = load_dataset(manifest(tmp_path))
    for recipe, validating in ((PAPER, 0), (DEFAULT, 1)):
        material = Material.whole(data, recipe, seed=0)
        assert len(material.seen) == 12
        assert len(actors(material.validate)) == validating
        assert material.test == []


def test_a_manifests_own_split_is_kept(tmp_path):
    material = gather(manifest(tmp_path, column=["train", "train", "validation", "test"]), DEFAULT, clips=0, seed=0)
    assert actors(material.learn) == {"actor 0", "actor 1"}
    assert actors(material.validate) == {"actor 2"}
    assert actors(material.test) == {"actor 3"}
