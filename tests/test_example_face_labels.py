"""The example with a camera, whole: a film of a real person, the real analyser, a real service."""

import json
import os
import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from live import Live
from pages import ROOT

PYTHON = ROOT / ".venv-face" / "bin" / "python"
EXAMPLE = ROOT / "examples" / "face_labels"

FILM = """
import sys
from importlib.util import find_spec
from pathlib import Path
import cv2
import numpy as np
person = cv2.imread(str(Path(find_spec("skimage").origin).parent / "data" / "astronaut.png"))
film = cv2.VideoWriter(sys.argv[1], cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (512, 512))
for number in range(50):
    film.write(person if 10 <= number < 30 else np.full_like(person, 90))
film.release()
"""
"""A second of an empty room, two of the astronaut of scikit-image (she smiles), two of the empty room."""

GUESSES = """
import json
from importlib.util import find_spec
from pathlib import Path
import cv2
import numpy as np
from face import FaceAnalyser
file = Path(find_spec("skimage").origin).parent / "data" / "astronaut.png"
person = cv2.cvtColor(cv2.imread(str(file)), cv2.COLOR_BGR2RGB)
analyse = FaceAnalyser()
many = np.load(file.with_name("lfw_subset.npy"))[:100]  # faces of 25 x 25, without a place around them to be found in
said = [analyse.classify((255 * face).astype(np.uint8)) for face in many]
print(json.dumps([analyse(person), analyse(np.full_like(person, 90)), analyse(person[300:, :, :]), said]))
"""


def in_its_environment(*arguments: str) -> str:
    done = subprocess.run(
        [str(PYTHON), *arguments], capture_output=True, text=True, check=False, cwd=EXAMPLE, timeout=110
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(autouse=True)
def _installed() -> None:
    if not PYTHON.exists():
        if os.environ.get("CI"):
            pytest.fail("make .venv-face/stamp was not run")
        pytest.skip("the example is not installed: make .venv-face/stamp")


@pytest.mark.slow
def test_a_smile_becomes_the_label_joy_of_real_estimates(live: Live, tmp_path: Path):
    film = str(tmp_path / "film.avi")
    in_its_environment("-c", FILM, film)
    lines = [json.loads(line) for line in in_its_environment("watch.py", film, "--url", live.stream).splitlines()]
    assert [line["t"] for line in lines] == [round(0.1 * number, 3) for number in range(50)]
    assert {line["label"] for line in lines[:10]} == {"unknown"}
    assert {line["label"] for line in lines[15:30]} == {"joy"}
    assert lines[-1]["label"] == "unknown"
    with_pose = [line for line in lines if line["intensity"] is not None][:20]  # as long as she is there
    assert [line["t"] for line in with_pose] == [round(0.1 * number, 3) for number in range(10, 30)]
    assert [line["emotion"] for line in with_pose] == [line["label"] for line in with_pose]
    assert all(0.0 <= line["intensity"] <= 1.0 and line["level"] in ("weak", "strong") for line in with_pose)


@pytest.mark.slow
def test_a_face_that_is_there_is_classified_and_none_is_invented():
    face, nothing, suit, many = json.loads(in_its_environment("-c", GUESSES))
    assert sum(face.values()) == pytest.approx(1.0, abs=1e-3)
    assert max(face, key=face.get) == "joy"
    assert face["joy"] > 0.6
    assert nothing is None
    assert suit is None
    likeliest = Counter(max(said, key=said.get) for said in many)
    assert len(likeliest) >= 4  # people of the news, with all kinds of faces
    assert max(likeliest.values()) < 60


def test_a_source_that_is_none_is_one_sentence():
    done = subprocess.run(
        [str(PYTHON), "watch.py", "none.avi", "--url", "ws://127.0.0.1:1"],
        capture_output=True, text=True, check=False, cwd=EXAMPLE, timeout=110,
    )  # fmt: skip
    assert done.returncode in (1, 69)
    assert done.stderr.splitlines()[-1].startswith("watch.py: ")


def pins(file: Path) -> dict[str, str]:
    return dict(re.findall(r"^([\w.-]+)==([\w.]+)", file.read_text(encoding="utf-8"), re.MULTILINE))


def test_its_environment_is_what_its_requirements_say():
    wanted = pins(EXAMPLE / "requirements.txt")
    listed = in_its_environment("-m", "pip", "--disable-pip-version-check", "list", "--format", "json")
    there = {entry["name"]: entry["version"] for entry in json.loads(listed)}
    assert {name: there.get(name) for name in wanted} == wanted
    ours = pins(ROOT / "constraints.txt")
    other = {name for name in wanted.keys() & ours.keys() if wanted[name] != ours[name]}
    assert other == {"protobuf"}  # mediapipe's is an old one
