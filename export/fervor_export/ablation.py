"""What each choice of the default recipe is worth: the recipe with one thing changed, trained and judged alike.

Every variant learns from the same clips with the same seeds and is judged by the same clips of other actors, so a
difference to the default is the change's, or chance: that is what several seeds are for. What a choice is meant for is
measured too: lost joints, sensors that mount their axes otherwise, no label, streams of minutes. A clip's estimate is
the mean over its frames after the first second, whatever the variant was trained to say: it is what a robot gets.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.rotations import from_rotvec, multiply
from fervor_export.batches import LEGS
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.evaluation.drift import drift
from fervor_export.evaluation.estimator import Estimates, Motion, NetworkEstimator, Reading
from fervor_export.evaluation.metrics import score, within_emotions
from fervor_export.evaluation.remembered import remembered
from fervor_export.material import Material
from fervor_export.network import Network
from fervor_export.recipe import DEFAULT, Recipe
from fervor_export.training import copies, train
from fervor_export.training_state import identity, name_of

Floats = npt.NDArray[np.float64]

LEFT_ARM = (3, 4, 5)
"""Shoulder, elbow, wrist."""

TURN_DEG = 8.0
"""Standard deviation of the constant turn of each joint that stands for another sensor's axes."""

SHORT_S = 2.0
"""A short look at a clip: its warm-up and a second more."""

DRIFT_MINUTES = 2


@dataclass(frozen=True, slots=True)
class Variant:
    """The default recipe with one choice undone or made otherwise."""

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Fields of `Recipe`."""

    def recipe(self, base: Recipe) -> Recipe:
        """The variant of a recipe."""
        return replace(base, **self.changes)


BASE = Variant("default")

VARIANTS: tuple[Variant, ...] = (
    Variant("Euler angles, no velocities", {"features": "euler"}),
    Variant("features not standardised", {"standardise": False}),
    Variant("additive head", {"head": "additive"}),
    Variant("loss at the last frame", {"loss_at": "last"}),
    Variant("loss from the first frame on", {"settle_s": 0.0}),
    Variant("absolute error alone, no CCC", {"ccc_weight": 0.0}),
    Variant("no loss without a label", {"unknown_share": 0.0}),
    Variant("no crops", {"crop": 0.0}),
    Variant("no joined clips", {"join": 0.0}),
    Variant("streams of 8 s at most", {"longest_s": 8.0}),
    Variant("no single joints lost", {"joint_dropout": 0.0}),
    Variant("legs never lost", {"leg_dropout": 0.0}),
    Variant("wrists never lost", {"wrist_dropout": 0.0}),
    Variant("trunk never lost", {"trunk_dropout": 0.0}),
    Variant("axes never turned", {"bind_noise_deg": 0.0}),
    Variant("mirror images too", {"mirror": True}),
    Variant("RMSprop, as the paper's", {"optimizer": "rmsprop", "learning_rate": 1e-3}),
    Variant("a quarter of the learning rate", {"learning_rate": DEFAULT.learning_rate / 4}),
    Variant("learning rate not annealed", {"anneal": False}),
    Variant("no weight decay", {"weight_decay": 0.0}),
    Variant("gradients not clipped", {"clip_gradient": None}),
    Variant("batches of 256", {"batch_size": 256}),
    Variant("last epoch kept", {"keep": "last"}),
)
"""One change each. `epochs` and `patience` say how long, not how; `phases` needs recordings faster than 30 Hz."""


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure that variants are compared by."""

    name: str
    title: str
    more_is_better: bool = True


MEASURES: tuple[Measure, ...] = (
    Measure("r_within", "r within emotion"),
    Measure("ccc", "CCC"),
    Measure("mae", "MAE", more_is_better=False),
    Measure("two_seconds", "r, first 2 s"),
    Measure("no_label", "r, no label"),
    Measure("one_arm", "r, left arm lost"),
    Measure("no_legs", "r, legs lost"),
    Measure("turned", f"r, axes turned by {TURN_DEG:g}°"),
    Measure("staggered", "staggered, off", more_is_better=False),
    Measure("stateful", "one state, off", more_is_better=False),
)
"""All r are within emotion. The last two: mean absolute difference to a fresh state's estimate, over minutes."""

Results = dict[str, list[dict[str, float]]]
"""Variant -> seed -> measure."""


def ablate(
    material: Material,
    base: Recipe,
    *,
    variants: Sequence[Variant] = VARIANTS,
    seeds: int = 2,
    folder: Path | None = None,
    tell: Callable[[str, int], None] = lambda _what, _done: None,
    on_epoch: Callable[[Any], None] = lambda _: None,
) -> Results:
    """Train and judge all variants.

    Args:
        material: clips to learn from, to choose the epoch by and to judge by.
        base: the recipe.
        variants: what to change of it.
        seeds: how often each is trained; seeds 0, 1, …
        folder: of what was done so far, to go on from.
        tell: told what begins, and how many trainings are done.
        on_epoch: told of each epoch.
    """
    results: Results = {variant.name: [] for variant in (BASE, *variants)}
    done = 0
    for seed in range(seeds):  # seeds outside, so that an early stop leaves whole comparisons
        for variant in (BASE, *variants):
            tell(f"{variant.name}, seed {seed}", done)
            results[variant.name].append(_judged(material, variant.recipe(base), seed, folder, on_epoch))
            done += 1
    return results


def _judged(
    material: Material, recipe: Recipe, seed: int, folder: Path | None, on_epoch: Callable[[Any], None]
) -> dict[str, float]:
    learn = copies(material.learn, recipe)
    whose = identity(learn, material.validate, recipe, seed=seed)

    def make() -> dict[str, Floats]:
        state = None if folder is None else folder / f"{name_of(whose)}.pt"
        network = train(learn, material.validate, recipe, seed=seed, state=state, on_epoch=on_epoch).network
        return {name: np.asarray(value) for name, value in measures(network, material.test).items()}

    causes = (name_of(whose), identity(material.test, (), recipe, seed=seed), [measure.name for measure in MEASURES])
    return {name: float(value) for name, value in remembered(folder, causes, make).items()}


def measures(network: Network, clips: Sequence[Clip]) -> dict[str, float]:
    """All of `MEASURES` of a network, by clips it has not learned from; nan where one is not defined."""
    estimator, reading = NetworkEstimator(network), Reading(last=False)
    plain = estimator.estimate([Motion.of(clip) for clip in clips])
    own = score(reading.labelled(clips, plain), clips, resamples=0)
    short = [values[: round(SHORT_S * RATE_HZ)] for values in plain]

    def seen(change: Callable[[Clip, int], Motion]) -> Sequence[Estimates]:
        return estimator.estimate([change(clip, index) for index, clip in enumerate(clips)])

    found = {
        "r_within": own.r_within.value,
        "ccc": own.ccc.value,
        "mae": own.mae.value,
        "two_seconds": within_emotions(reading.labelled(clips, short), clips),
        "no_label": within_emotions(reading.unlabelled(plain), clips),
        "one_arm": within_emotions(reading.labelled(clips, seen(_without(LEFT_ARM))), clips),
        "no_legs": within_emotions(reading.labelled(clips, seen(_without(LEGS))), clips),
        "turned": within_emotions(reading.labelled(clips, seen(_turned)), clips),
    }
    found |= {kind.memory: kind.apart for kind in drift([(estimator, clips)], minutes=DRIFT_MINUTES, streams=2)}
    return {name: np.nan if value is None else float(value) for name, value in found.items()}


def _without(joints: Sequence[int]) -> Callable[[Clip, int], Motion]:
    def lose(clip: Clip, _index: int) -> Motion:
        mask = clip.mask.copy()
        mask[:, list(joints)] = False
        return Motion(clip.rotations, mask)

    return lose


def _turned(clip: Clip, index: int) -> Motion:
    """As a sensor that mounts its axes otherwise would send it; another one for each clip."""
    random = np.random.default_rng((index, 1))
    turn = random.normal(0.0, np.deg2rad(TURN_DEG), (clip.rotations.shape[1], 3)).astype(np.float32)
    return Motion(multiply(clip.rotations, from_rotvec(turn)).astype(np.float32), clip.mask)
