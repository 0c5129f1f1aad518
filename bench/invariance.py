"""Prints what sensor, frame rate and lost frames change of the intensity: the tables of docs/reference/invariance.md.

    python -m bench.invariance [FOLDER] [--model MODEL.onnx]

FOLDER holds real motion as BVH, at any depth; without it the tables that need some are left out. Intensities come from
the scorer, whose estimates are a stream's to the bit. The first second of every motion, in which estimates are warming
up, does not count.
"""

import argparse
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import spearmanr

from fervor.emotions import EMOTIONS
from fervor.model import Model, default_model_path
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor.scoring.scorer import Scorer
from fervor.scoring.take import Take
from fervor.session.body import Terms
from fervor.session.events import Source
from fervor.skeletons.canonical import C13
from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.landmarks import LANDMARKS, Landmarks
from fervor.skeletons.skeleton import Skeleton
from fervor_export.synthetic import synthesise_motion

sys.path.append(str(Path(__file__).parents[1] / "tests"))  # whose renderer knows nothing of the alignments
from sensors import Array, Build, as_seen, landmarked, rendered

RATE, FINE = 30.0, 120.0
SECONDS = 10.0
WARM_UP_S = 1.0
MOVES = 0.01
"""An intensity that varies less than this (SD) has no course that could be compared."""

CAMERA = Rotation.from_euler("YX", [160, 15], degrees=True)
"""The person stands before it, a little aside; it looks down."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One motion on the rig."""

    name: str
    times: Array  # [frame] s
    local: Array  # [frame, 13, 4]

    def every(self, step: int) -> "Motion":
        return Motion(self.name, self.times[::step], self.local[::step])


class Scoring:
    """A model, and what it says of motions."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._scorer = Scorer(model)

    def of(self, motions: Sequence[Motion], source: Skeleton | Landmarks, sent: Sequence[Array]) -> list[Array]:
        """Intensities [frame, emotion] of each motion, as `source` sent it; NaN: joint not tracked."""
        axes = "global" if isinstance(source, Landmarks) else source.axes
        takes = [
            Take(motion.name, motion.times, np.nan_to_num(poses), ~np.isnan(poses).any(axis=-1))
            for motion, poses in zip(motions, sent, strict=True)
        ]
        scored = self._scorer.score(takes, Terms(self.model.metadata, Source(source, axes), by_emotion=True))
        return [each.by_emotion[motion.times >= WARM_UP_S] for motion, each in zip(motions, scored, strict=True)]


def main() -> None:
    """Run all and print Markdown."""
    parser = argparse.ArgumentParser(prog="python -m bench.invariance")
    parser.add_argument("folder", type=Path, nargs="?", help="real motion as BVH")
    parser.add_argument("--model", type=Path, default=default_model_path())
    options = parser.parse_args()
    scoring = Scoring(Model.load(options.model))
    metadata = scoring.model.metadata
    print(f"Model: `{metadata.name}` {metadata.version} ({metadata.purpose}, sha256 {scoring.model.sha256[:12]}…).\n")
    made = [synthetic(emotion, seed) for seed, emotion in enumerate(EMOTIONS)]
    print("## Sensors\n")
    by_sensor(scoring, [motion.every(round(FINE / RATE)) for motion in made])
    print("\n## Frame rates and lost frames\n")
    by_rate(scoring, made)
    if options.folder:
        print("\n## Points instead of rotations\n")
        by_points(scoring, [read(path) for path in sorted(options.folder.rglob("*.bvh"))])


def synthetic(emotion: str, seed: int) -> Motion:
    """Somebody who shows an emotion more and more, at `FINE`."""
    times, local = synthesise_motion(
        emotion=emotion, intensity=lambda t: t / SECONDS, seconds=SECONDS, seed=seed, rate_hz=FINE
    )
    return Motion(emotion, times, local)


def read(path: Path) -> Motion:
    times, local, _ = rig_poses(read_recording(path))
    return Motion(path.stem, times, local)


# --- tables -----------------------------------------------------------------------------------------------------------


def by_sensor(scoring: Scoring, motions: Sequence[Motion]) -> None:
    whole = scoring.of(motions, C13, [motion.local for motion in motions])
    head("sensor", "joints seen", "same joints: mean", "max", "all of C13: mean", "max")
    for name, source in (*SKELETONS.items(), *LANDMARKS.items()):
        if name == "c13":
            continue
        poses = [as_seen(source, m.local) if isinstance(source, Skeleton) else m.local for m in motions]
        same = scoring.of(motions, C13, [np.where(np.array(source.sees)[:, None], pose, np.nan) for pose in poses])
        seen = scoring.of(motions, source, [sent(source, pose) for pose in poses])
        row(f"`{name}`", f"{sum(source.sees)} of 13", *apart(seen, same), *apart(seen, whole))


def by_rate(scoring: Scoring, motions: Sequence[Motion]) -> None:
    whole = [motion.every(round(FINE / RATE)) for motion in motions]
    expected = scoring.of(whole, C13, [motion.local for motion in whole])
    spread = np.concatenate(
        [intensity[:, EMOTIONS.index(m.name)] for m, intensity in zip(whole, expected, strict=True)]
    )
    head("stream", "mean", "max")
    for rate in (15.0, 30.0, 60.0, 120.0):
        streamed = [motion.every(round(FINE / rate)) for motion in motions]
        seen = scoring.of(streamed, C13, [motion.local for motion in streamed])
        row(f"{rate:g} Hz", *apart(*at_shared_times(streamed, seen, whole, expected)))
    random = np.random.default_rng(0)
    for share in (0.05, 0.30):
        kept = [np.union1d(0, np.flatnonzero(random.random(len(motion.times)) >= share)) for motion in whole]
        streamed = [Motion(m.name, m.times[k], m.local[k]) for m, k in zip(whole, kept, strict=True)]
        seen = scoring.of(streamed, C13, [motion.local for motion in streamed])
        row(f"30 Hz, {share:.0%} of the frames lost", *apart(*at_shared_times(streamed, seen, whole, expected)))
    print(
        f"\nFor comparison: these intensities vary by {spread.std():.3f} (SD) over all motions, emotions and instants."
    )


def by_points(scoring: Scoring, motions: Sequence[Motion]) -> None:
    whole = scoring.of(motions, C13, [motion.local for motion in motions])
    head("file", "sensor", "mean", "max", "SD of the true course", "r over time", "rank r over time", "courses")
    seen = {
        name: scoring.of(motions, source, [sent(source, motion.local) for motion in motions])
        for name, source in LANDMARKS.items()
    }
    for place, motion in enumerate(motions):
        for name in ("mediapipe", "coco17", "points"):  # body25 has coco17's points
            a, b = seen[name][place], whole[place]
            moving = np.flatnonzero((b.std(axis=0) > MOVES) & (a.std(axis=0) > MOVES / 10))
            r = [np.corrcoef(a[:, e], b[:, e])[0, 1] for e in moving]
            ranks = [spearmanr(a[:, e], b[:, e]).statistic for e in moving]
            together = [np.mean(values) if values else "-" for values in (r, ranks)]
            row(motion.name, f"`{name}`", *apart([a], [b]), b.std(axis=0).mean(), *together, f"{len(moving)} of 11")
    print()
    head("sensor", "mean over all files", "rank r of the means of all files and emotions", "longer waist: mean", "max")
    for name, source in LANDMARKS.items():
        means, true = (np.concatenate([i.mean(axis=0) for i in taken]) for taken in (seen[name], whole))
        long = scoring.of(motions, source, [sent(source, motion.local, Build(waist=1.3)) for motion in motions])
        rank = spearmanr(means, true).statistic
        row(f"`{name}`", apart(seen[name], whole)[0], rank, *apart(long, seen[name]))


def head(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |\n|{'---|' * len(cells)}")


def row(*cells: str | float) -> None:
    print(f"| {' | '.join(cell if isinstance(cell, str) else number(cell) for cell in cells)} |", flush=True)


def number(value: float) -> str:
    return "< 0.0001" if 0.0 <= value < 0.0001 else f"{value:.4f}" if value < 0.01 else f"{value:.3f}"


# --- motions and differences ------------------------------------------------------------------------------------------


def sent(source: Skeleton | Landmarks, local: Array, build: Build = Build()) -> Array:  # noqa: B008  # frozen
    if isinstance(source, Landmarks):
        return landmarked(source, local, build, CAMERA)
    return rendered(source, local, CAMERA)


def apart(one: Iterable[Array], other: Iterable[Array]) -> tuple[float, float]:
    """Mean and largest difference of intensities."""
    differences = np.concatenate([np.abs(a - b).ravel() for a, b in zip(one, other, strict=True)])
    return float(differences.mean()), float(differences.max())


def at_shared_times(
    streamed: Sequence[Motion], seen: Sequence[Array], whole: Sequence[Motion], expected: Sequence[Array]
) -> tuple[list[Array], list[Array]]:
    """Intensities at the instants that both have."""
    pairs = []
    for one, a, other, b in zip(streamed, seen, whole, expected, strict=True):
        instants = [np.rint(m.times[m.times >= WARM_UP_S] * FINE).astype(int) for m in (one, other)]
        _, left, right = np.intersect1d(*instants, return_indices=True)
        pairs.append((a[left], b[right]))
    return [a for a, _ in pairs], [b for _, b in pairs]


if __name__ == "__main__":
    main()
