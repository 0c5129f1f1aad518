"""The sample recording of `fervor demo`: one person whose joy grows, is strong, and fades, written as a BVH file.

    python -m fervor_export.synthetic.sample joy.bvh

writes the very file that is packaged with the service (`fervor/samples/joy.bvh`); nothing in it is drawn anew.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fervor_export.synthetic.motion import synthesise_motion
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.tracks import Array, minimum_jerk

SECONDS, RATE_HZ, SEED = 36.0, 60.0, 21
"""Of 24 seeds one in which growing and fading are plain to the bundled model: a sample is to show, not to prove."""

WEAK, STRONG = 0.03, 1.0

Offset = tuple[float, float, float]

TREE: tuple[tuple[str, str, Offset, int | None], ...] = (
    ("Hips", "", (0.0, 95.0, 0.0), None),
    ("Chest", "Hips", (0.0, 10.0, 0.0), 0),
    ("Chest2", "Chest", (0.0, 10.0, 0.0), None),
    ("Chest3", "Chest2", (0.0, 9.0, 0.0), 1),
    ("Chest4", "Chest3", (0.0, 9.0, 0.0), None),
    ("Neck", "Chest4", (0.0, 12.0, 0.0), None),
    ("Head", "Neck", (0.0, 9.0, 0.0), 2),
    ("RightCollar", "Chest4", (-3.0, 7.0, 0.0), None),
    ("RightShoulder", "RightCollar", (-15.0, 0.0, 0.0), 6),
    ("RightElbow", "RightShoulder", (0.0, -30.0, 0.0), 7),
    ("RightWrist", "RightElbow", (0.0, -26.0, 0.0), 8),
    ("LeftCollar", "Chest4", (3.0, 7.0, 0.0), None),
    ("LeftShoulder", "LeftCollar", (15.0, 0.0, 0.0), 3),
    ("LeftElbow", "LeftShoulder", (0.0, -30.0, 0.0), 4),
    ("LeftWrist", "LeftElbow", (0.0, -26.0, 0.0), 5),
    ("RightHip", "Hips", (-9.0, -3.0, 0.0), 11),
    ("RightKnee", "RightHip", (0.0, -43.0, 0.0), 12),
    ("RightAnkle", "RightKnee", (0.0, -42.0, 0.0), None),
    ("LeftHip", "Hips", (9.0, -3.0, 0.0), 9),
    ("LeftKnee", "LeftHip", (0.0, -43.0, 0.0), 10),
    ("LeftAnkle", "LeftKnee", (0.0, -42.0, 0.0), None),
)
"""The EBMDB's names and its zero pose (arms hanging): name, parent, offset in cm, joint of the rig that turns it."""

ENDS: dict[str, Offset] = {
    "Head": (0.0, 18.0, 0.0),
    "RightWrist": (0.0, -18.0, 0.0),
    "LeftWrist": (0.0, -18.0, 0.0),
    "RightAnkle": (0.0, -7.0, 16.0),
    "LeftAnkle": (0.0, -7.0, 16.0),
}
"""Tips of the last bones, in cm."""


def joy(times: Array) -> Array:
    """Intensity [frame] at times [frame]: weak, from 8 s growing, strong from 15 to 23 s, then fading until 30 s."""
    grown, faded = minimum_jerk((times - 8.0) / 7.0), minimum_jerk((times - 23.0) / 7.0)
    return WEAK + (STRONG - WEAK) * (grown - faded)


def motion() -> tuple[Array, Array]:
    """Times [frame] and local rotations [frame, 13, 4] of the sample."""
    rng = np.random.default_rng(SEED)
    person, scene = Person.draw(rng, "sample"), Scene.draw(rng, "stand", "talk")
    return synthesise_motion(
        emotion="joy", intensity=joy, seconds=SECONDS, seed=SEED, rate_hz=RATE_HZ, person=person, scene=scene
    )


def bvh(rotations: Array, rate_hz: float) -> str:
    """A BVH file's text for local rotations [frame, 13, 4] xyzw."""
    frames = len(rotations)
    angles = np.zeros((frames, len(TREE), 3))  # [frame, joint, YXZ] degrees
    for index, (_, _, _, joint) in enumerate(TREE):
        if joint is not None:
            angles[:, index] = Rotation.from_quat(rotations[:, joint]).as_euler("YXZ", degrees=True)
    angles = np.unwrap(angles, period=360.0, axis=0)
    rows = (_row(frame) for frame in angles.reshape(frames, -1))
    head = "\n".join(_hierarchy("", 0))
    return f"HIERARCHY\n{head}\nMOTION\nFrames: {frames}\nFrame Time: {1.0 / rate_hz:.8f}\n" + "\n".join(rows) + "\n"


def _row(angles: Array) -> str:
    """One frame: the root's place, which is not moved, and all angles to a hundredth of a degree."""
    place = " ".join(f"{value:g}" for value in TREE[0][2])
    return f"{place} " + " ".join(f"{value:.2f}".rstrip("0").rstrip(".") for value in angles + 0.0)


def _hierarchy(parent: str, depth: int) -> list[str]:
    """Lines of the joint tree below `parent`."""
    lines: list[str] = []
    pad = " " * depth
    for name, above, offset, _ in TREE:
        if above != parent:
            continue
        place = "" if parent else "Xposition Yposition Zposition "
        x, y, z = offset if parent else (0.0, 0.0, 0.0)
        lines += [f"{pad}{'JOINT' if parent else 'ROOT'} {name}", f"{pad}{{", f"{pad} OFFSET {x:g} {y:g} {z:g}"]
        lines.append(f"{pad} CHANNELS {6 if not parent else 3} {place}Yrotation Xrotation Zrotation")
        lines += _hierarchy(name, depth + 1)
        if name in ENDS:
            x, y, z = ENDS[name]
            lines += [f"{pad} End Site", f"{pad} {{", f"{pad}  OFFSET {x:g} {y:g} {z:g}", f"{pad} }}"]
        lines.append(f"{pad}}}")
    return lines


def main(arguments: list[str] | None = None) -> None:
    """Write the sample."""
    parser = argparse.ArgumentParser(description="Write the sample recording of `fervor demo`.")
    parser.add_argument("out", type=Path, help="BVH file to write")
    out: Path = parser.parse_args(arguments).out
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(bvh(motion()[1], RATE_HZ), encoding="ascii")


if __name__ == "__main__":
    main()
