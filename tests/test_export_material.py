"""What a run learns from: no actor on two sides, neutral left out, a manifest's own split kept."""

from datasets import motion, write_npz
from fervor_export.material import gather


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
        material = gather(source, clips=300, seed=1)
        sides = [actors(part) for part in (material.learn, material.validate, material.test)]
        assert all(sides)
        assert len(set.union(*sides)) == sum(map(len, sides))
        assert len(material.seen) == len(material.learn) + len(material.validate)


def test_a_data_set_is_research_and_its_neutral_clips_are_left_out(tmp_path):
    material = gather(manifest(tmp_path), clips=0, seed=0)
    assert material.purpose == "research"
    emotions = {clip.emotion for clip in [*material.seen, *material.test]}
    assert emotions == {"joy"}
    assert gather("synthetic", clips=100, seed=0).purpose == "demo"


def test_a_manifests_own_split_is_kept(tmp_path):
    material = gather(manifest(tmp_path, column=["train", "train", "validation", "test"]), clips=0, seed=0)
    assert actors(material.learn) == {"actor 0", "actor 1"}
    assert actors(material.validate) == {"actor 2"}
    assert actors(material.test) == {"actor 3"}
