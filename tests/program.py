"""The `fervor` program as a person runs it, and a recording to give it."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

FERVOR = str(Path(sys.executable).with_name("fervor"))

# joint: parent, offset in cm; a person in a T-pose
TREE = {
    "Hips": (None, (0, 100, 0)),
    "Spine": ("Hips", (0, 20, 0)),
    "Spine1": ("Spine", (0, 20, 0)),
    "Neck": ("Spine1", (0, 20, 0)),
    "Head": ("Neck", (0, 10, 0)),
    "LeftArm": ("Spine1", (18, 15, 0)),
    "LeftForeArm": ("LeftArm", (28, 0, 0)),
    "LeftHand": ("LeftForeArm", (26, 0, 0)),
    "RightArm": ("Spine1", (-18, 15, 0)),
    "RightForeArm": ("RightArm", (-28, 0, 0)),
    "RightHand": ("RightForeArm", (-26, 0, 0)),
    "LeftUpLeg": ("Hips", (10, -5, 0)),
    "LeftLeg": ("LeftUpLeg", (0, -42, 0)),
    "RightUpLeg": ("Hips", (-10, -5, 0)),
    "RightLeg": ("RightUpLeg", (0, -42, 0)),
}


def fervor(*arguments: object, timeout: float = 60, **options) -> "subprocess.CompletedProcess[str]":
    """Run the program to its end, its output captured."""
    return subprocess.run(
        [FERVOR, *map(str, arguments)], capture_output=True, text=True, timeout=timeout, check=False, **options
    )


def start_fervor(*arguments: object, **environment: str) -> "subprocess.Popen[str]":
    """Start the program; its output is to be read as it comes."""
    return subprocess.Popen(
        [FERVOR, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )


def write_bvh(path: Path, *, seconds: float = 2.0, rate_hz: float = 60.0) -> Path:
    """A person who waves both arms, twice a second, wider and wider."""
    frames = round(seconds * rate_hz) + 1
    times = np.arange(frames) / rate_hz
    angles = np.zeros((frames, len(TREE), 3))
    swing = 60.0 * (0.2 + times / max(seconds, 1.0)) * np.sin(4.0 * np.pi * times)
    for name, sign in (("LeftArm", 1), ("RightArm", -1), ("LeftForeArm", 1), ("RightForeArm", -1)):
        angles[:, list(TREE).index(name), 0] = sign * swing
    rows = [" ".join(["0 100 0", *(f"{angle:.4f}" for angle in frame.ravel())]) for frame in angles]
    motion = ["MOTION", f"Frames: {frames}", f"Frame Time: {1.0 / rate_hz:.7f}", *rows]
    path.write_text("\n".join(["HIERARCHY", *_joint("Hips"), *motion]) + "\n")
    return path


def _joint(name: str) -> list[str]:
    parent, offset = TREE[name]
    positions = "6 Xposition Yposition Zposition" if parent is None else "3"
    below = [line for child, (above, _) in TREE.items() if above == name for line in _joint(child)]
    return [
        f"{'ROOT' if parent is None else 'JOINT'} {name}",
        "{",
        "OFFSET {} {} {}".format(*offset),
        f"CHANNELS {positions} Zrotation Yrotation Xrotation",
        *(below or ["End Site", "{", "OFFSET 0 10 0", "}"]),
        "}",
    ]
