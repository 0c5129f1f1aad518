"""Prints whether estimates follow edits of real motion whose direction is known: faster, bent, opened, held in.

    python -m bench.counterfactual FOLDER [--model MODEL.onnx]

FOLDER holds real motion as BVH, at any depth. Pieces of it are edited towards more of an emotion, as studies of
movement describe it (`bench.edits`), by several strengths. Nobody has rated them: this says whether a model goes the
way that the literature goes on bodies that no generator made, not whether people would agree.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from bench.edits import MORE, Array, Cut, Edit, Source, edited
from fervor.emotions import EMOTIONS, emotion_index
from fervor.model import Model, default_model_path
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import rig_poses
from fervor.rotations import angle_between
from fervor.skeletons.rig import UPPER_BODY

STRENGTHS = (-0.5, 0.0, 0.5, 1.0)
SECONDS, HOP_S = 4.0, 2.0
WARM_UP_FRAMES = 30
DRAWS = 8
"""How often each cut is edited at a random strength, with what has nothing to do with the emotion drawn, too."""


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What a model and a speedometer say of motions."""

    intensity: Array  # [motion, emotion] mean after the first second
    spread: Array  # [motion, emotion] deviation over time
    speed: Array  # [motion] mean angular speed of the upper body, rad/s


@dataclass(frozen=True, slots=True)
class Row:
    """How estimates of one emotion follow its edits."""

    emotion: str
    ordered: float  # share of pairs of strengths, same cut, in which the stronger edit is estimated higher
    rank_r: float  # Spearman over different cuts with everything else drawn
    speed_r: float  # of mean speed with the same strengths
    own: float  # share of cuts in which this emotion rises more than the others' mean from none to whole
    low: float  # 10th and 90th percentile of the estimates
    high: float


def main() -> None:
    """Run all and print Markdown."""
    parser = argparse.ArgumentParser(prog="python -m bench.counterfactual")
    parser.add_argument("folder", type=Path, help="real motion as BVH")
    parser.add_argument("--model", type=Path, default=default_model_path())
    options = parser.parse_args()
    model = Model.load(options.model)
    cuts = cuts_of([read(path) for path in sorted(options.folder.rglob("*.bvh"))])
    print(f"{len(cuts)} cuts of {SECONDS:g} s\n")
    table(measure(model, cuts))
    print()
    as_they_are(model, cuts)


def read(path: Path) -> Source:
    """A BVH file on the rig."""
    times, local, _ = rig_poses(read_recording(path))
    return Source(path.stem, times, local)


def cuts_of(sources: Sequence[Source]) -> list[Cut]:
    """Pieces of `SECONDS`, one every `HOP_S`."""
    rng = np.random.default_rng(0)
    cuts = []
    for source in sources:
        for begin in np.arange(source.times[0], source.times[-1] - SECONDS + 1e-6, HOP_S):
            side, phases = float(rng.choice((-1.0, 1.0))), rng.uniform(0.0, 2.0 * np.pi, 3)
            cuts.append(Cut(source, float(begin) + SECONDS / 2, SECONDS, side=side, phases=phases))
    return cuts


def read_out(model: Model, motions: Sequence[Array]) -> Reading:
    """Estimates of motions [frame, 13, 4] of one length, each from a fresh state."""
    rotations = np.stack(motions).astype(np.float32)
    batch, frames = rotations.shape[:2]
    mask = np.ones((batch, frames, 13), np.float32)
    emotion = np.zeros((batch, frames, len(EMOTIONS)), np.float32)
    out = model.run(rotations, mask, emotion, model.zero_states(batch)).intensity_by_emotion[:, WARM_UP_FRAMES:]
    upper = list(UPPER_BODY)
    turned = angle_between(rotations[:, 1:, upper].astype(float), rotations[:, :-1, upper].astype(float)) * 30.0
    return Reading(out.mean(1), out.std(1), turned.mean((1, 2)))


def measure(model: Model, cuts: Sequence[Cut]) -> list[Row]:
    """One row per emotion that has edits."""
    return [_row(model, cuts, emotion, edit) for emotion, edit in MORE.items()]


def _row(model: Model, cuts: Sequence[Cut], emotion: str, edit: Edit) -> Row:
    index = emotion_index(emotion)
    ladder = read_out(model, [edited(cut, edit.scaled(strength)) for cut in cuts for strength in STRENGTHS])
    steps = ladder.intensity.reshape(len(cuts), len(STRENGTHS), -1)  # [cut, strength, emotion]
    mine = steps[:, :, index]
    pairs = [(low, high) for high in range(len(STRENGTHS)) for low in range(high)]
    rise = steps[:, -1] - steps[:, STRENGTHS.index(0.0)]  # [cut, emotion]
    others = [place for place, name in enumerate(EMOTIONS) if name not in (emotion, "neutral")]
    strengths, drawn = draw(model, cuts, edit)
    return Row(
        emotion,
        float(np.mean([mine[:, high] > mine[:, low] for low, high in pairs])),
        float(spearmanr(strengths, drawn.intensity[:, index]).statistic),
        float(spearmanr(strengths, drawn.speed).statistic),
        float((rise[:, index] > rise[:, others].mean(1)).mean()),
        *map(float, np.percentile(drawn.intensity[:, index], (10, 90))),
    )


def draw(model: Model, cuts: Sequence[Cut], edit: Edit) -> tuple[Array, Reading]:
    """Random strengths [motion] of an edit and what is said of them, while tempo, size and posture vary besides."""
    rng = np.random.default_rng(1)
    strengths, motions = [], []
    for cut in cuts:
        for _ in range(DRAWS):
            strength = float(rng.uniform(-0.5, 1.0))
            whole = edit.scaled(strength)
            other = replace(
                whole,
                tempo=whole.tempo * float(np.exp(rng.normal(0.0, 0.35))),
                size=whole.size * float(np.exp(rng.normal(0.0, 0.3))),
                head=whole.head + float(rng.normal(0.0, 6.0)),
                bent=whole.bent + float(rng.normal(0.0, 6.0)),
                open=whole.open + float(rng.normal(0.0, 5.0)),
            )
            strengths.append(strength)
            motions.append(edited(cut, other))
    return np.array(strengths), read_out(model, motions)


def table(rows: Sequence[Row]) -> None:
    """Print the rows and their mean."""
    print("| emotion | pairs in order | rank r over cuts | of mean speed | rises most of all | 10 % | 90 % |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row.emotion} | {row.ordered:.2f} | {row.rank_r:.2f} | {row.speed_r:.2f} | {row.own:.2f} "
            f"| {row.low:.2f} | {row.high:.2f} |"
        )
    mean = [np.mean([getattr(row, name) for row in rows]) for name in ("ordered", "rank_r", "own")]
    speed = np.mean([abs(row.speed_r) for row in rows])
    print(f"| mean | {mean[0]:.2f} | {mean[1]:.2f} | {speed:.2f} (of its size) | {mean[2]:.2f} | | |")


def as_they_are(model: Model, cuts: Sequence[Cut]) -> None:
    """Print what is said of the recordings as they are, the mean over the cuts of each."""
    reading = read_out(model, [edited(cut, Edit()) for cut in cuts])
    print(f"| recording | {' | '.join(EMOTIONS)} | deviation over time |\n|{'---|' * (len(EMOTIONS) + 2)}")
    names = [cut.source.name for cut in cuts]
    for name in dict.fromkeys(names):
        mine = [place for place, other in enumerate(names) if other == name]
        values = " | ".join(f"{value:.2f}" for value in reading.intensity[mine].mean(0))
        print(f"| {name} | {values} | {reading.spread[mine].mean():.2f} |")
    unsure = ((reading.intensity > 0.05) & (reading.intensity < 0.95)).mean()
    print(f"\nBetween 0.05 and 0.95: {unsure:.0%} of the means.")


if __name__ == "__main__":
    main()
