"""The evaluation, whole: data in, one frozen result out.

`evaluate` trains a network for each fold of two protocols: folds of recordings, which is how the paper split if its
copies did not leak, and leaving actors out, which is what a robot meets. Where the data set brings a split of its own,
that comes first. `evaluate_model` judges a model that is there already by clips that it has not learned from; baseline
and controls then learn from the other actors of these clips.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fervor.errors import DataError
from fervor_export.clip import Clip
from fervor_export.data.dataset import Dataset
from fervor_export.evaluation import baseline, duplicates, handcrafted
from fervor_export.evaluation.drift import MINUTES, STREAMS, drift
from fervor_export.evaluation.estimator import Estimator, Reading
from fervor_export.evaluation.invariance import MOST_CLIPS, invariance
from fervor_export.evaluation.protocols import Budget, Learn, Learned, Learner, Run, run
from fervor_export.evaluation.result import Evaluation
from fervor_export.evaluation.splits import Split, Unit, as_given, by_actor, by_recording
from fervor_export.evaluation.summary import describe, summarise, thresholds_of, warnings_of, warnings_of_split
from fervor_export.export import library_versions
from fervor_export.recipe import Recipe
from fervor_export.training import Epoch

GIVEN, RECORDINGS, ACTORS, HELD_OUT = "given", "recordings", "actors", "held_out"
"""Names of the protocols."""


@dataclass(frozen=True, slots=True)
class Options:
    """How thorough an evaluation is."""

    folds: int = 5
    """Of the protocol by recording."""
    seed: int = 0
    """Of folds, training, resampling and everything else."""
    minutes: float | None = None
    """Of training, all folds of all protocols together."""
    grid: baseline.Grid = field(default_factory=lambda: baseline.GRID)
    """The baseline's settings."""
    invariance_clips: int = MOST_CLIPS
    drift_minutes: int = MINUTES
    drift_streams: int = STREAMS
    """In all."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """What is evaluated on."""

    clips: Sequence[Clip]
    """Not augmented."""
    source: str
    """What to call it."""
    procedural: bool
    """Whether a program made it."""
    splits: Mapping[str, Sequence[Clip]] = field(default_factory=dict)
    """Clips by the split that the data set brings along: train, validation, test."""
    notes: Sequence[str] = ()
    """What a reader must know of how the clips were come by: sentences, told among the warnings."""

    @classmethod
    def of(cls, data: Dataset) -> "Material":
        """A data set, with what was wrong with it."""
        return cls(data.clips, data.description, data.purpose == "demo", data.splits, data.notes)


@dataclass(frozen=True, slots=True)
class Watch:
    """Whom to tell how it goes."""

    stage: Callable[[str, int, int], None] = lambda _what, _done, _total: None
    """What begins, and how many of all trainings are done."""
    epoch: Callable[[Epoch], None] = lambda _: None


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The result, and the predictions of every clip behind it."""

    result: Evaluation
    runs: dict[str, Run]


def evaluate(
    material: Material,
    recipe: Recipe,
    *,
    keep: Path | None = None,
    options: Options | None = None,
    watch: Watch | None = None,
) -> Evaluated:
    """Train and judge a recipe.

    Args:
        material: the data set.
        recipe: how to learn.
        keep: folder of what was trained so far: an evaluation that is begun again goes on from it.
        options: how thorough.
        watch: whom to tell.

    Raises:
        DataError: no protocol can be run with these clips; says why.
    """
    options, watch = options or Options(), watch or Watch()
    learner = Learner(recipe, options.seed, watch.epoch, keep=keep)
    work = _Work(material, options, watch, Reading.of(recipe), f"recipe {recipe.name}", keep)
    work.find_repeats()
    work.split()
    work.run_all(learner.learn)
    return work.conclude()


def evaluate_model(
    estimator: Estimator,
    material: Material,
    reading: Reading,
    *,
    model: str,
    options: Options | None = None,
    watch: Watch | None = None,
) -> Evaluated:
    """Judge a model by clips of which the caller knows that it has not learned from them or their actors.

    Args:
        estimator: the model.
        material: the clips; see `held_out`.
        reading: how a clip's estimates become one number.
        model: what to call it.
        options: how thorough.
        watch: whom to tell.

    Raises:
        DataError: a single recording.
    """

    def known(_train: Sequence[Clip], _test: Sequence[Clip], _unit: Unit, _minutes: float | None) -> Learned:
        return Learned(estimator)

    work = _Work(material, options or Options(), watch or Watch(), reading, model)
    work.find_repeats()
    work.splits[HELD_OUT] = work.held_out()
    work.run_all(known)
    return work.conclude()


def title_of(name: str, split: Split) -> str:
    """What a protocol is called in reports."""
    titles = {
        GIVEN: "the data's own split",
        RECORDINGS: f"{len(split)} folds by recording",
        ACTORS: f"actors left out, {len(split)} folds",
        HELD_OUT: "held-out clips",
    }
    return titles[name]


@dataclass(slots=True)
class _Work:
    """An evaluation under way."""

    material: Material
    options: Options
    watch: Watch
    reading: Reading
    model: str
    keep: Path | None = None
    repeats: dict[str, str] = field(default_factory=dict)
    splits: dict[str, Split] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    runs: dict[str, Run] = field(default_factory=dict)
    done: int = 0

    def tell(self, what: str) -> None:
        self.watch.stage(what, self.done, sum(map(len, self.splits.values())))

    def find_repeats(self) -> None:
        self.tell("looking for recordings that repeat each other")
        self.repeats = duplicates.groups(self.material.clips)

    def split(self) -> None:
        """Protocols that these clips allow, and why not the others."""
        clips, options = self.material.clips, self.options
        given = self.material.splits
        learned = [*given.get("train", ()), *given.get("validation", ())]
        ways: dict[str, Callable[[], Split]] = {
            RECORDINGS: lambda: by_recording(clips, folds=options.folds, seed=options.seed, same=self.repeats),
            ACTORS: lambda: by_actor(clips, seed=options.seed, same=self.repeats),
        }
        if learned and given.get("test"):
            ways = {GIVEN: lambda: as_given(clips, learned, given["test"], same=self.repeats), **ways}
        for name, way in ways.items():
            try:
                self.splits[name] = way()
            except DataError as error:
                self.skipped[name] = error.message

    def held_out(self) -> Split:
        """Folds of clips that are new to a model, for baseline and controls; by recording where one actor is left."""
        clips, options = self.material.clips, self.options
        if len({clip.actor for clip in clips}) > 1:
            return by_actor(clips, seed=options.seed, same=self.repeats)
        folds = min(options.folds, len({self.repeats.get(clip.name, clip.name) for clip in clips}))
        return by_recording(clips, folds=folds, seed=options.seed, same=self.repeats)

    def run_all(self, learn: Learn) -> None:
        """Every protocol; one that can't be run is told of."""
        self.tell("handcrafted features")
        features = handcrafted.matrix(self.material.clips)
        budget = Budget(self.options.minutes, sum(map(len, self.splits.values())))
        for name, split in self.splits.items():
            title, before = title_of(name, split), self.done

            def stage(what: str, fold: int, title: str = title, before: int = before) -> None:
                self.done = before + fold
                self.tell(f"{title}: {what}")

            try:
                self.runs[name] = run(
                    self.material.clips, split, learn, self.reading, handcrafted=features, grid=self.options.grid,
                    keep=self.keep, budget=budget, seed=self.options.seed, tell=stage,
                )  # fmt: skip
            except DataError as error:
                self.skipped[name] = error.message
            self.done = before + len(split)

    def conclude(self) -> Evaluated:
        """Numbers from predictions."""
        if not self.runs:
            raise DataError(f"nothing can be evaluated with these clips: {'; '.join(self.skipped.values())}")
        material, options = self.material, self.options
        self.tell("intervals")
        protocols = tuple(
            summarise(name, title_of(name, self.splits[name]), run_, seed=options.seed)
            for name, run_ in self.runs.items()
        )
        name, last = list(self.runs.items())[-1]
        self.tell("invariance")
        changes = invariance(last.judged, self.reading, most=options.invariance_clips, seed=options.seed)
        self.tell("drift")
        each = max(1, options.drift_streams // len(last.judged))
        judged = last.judged[: options.drift_streams]
        drifts = drift(judged, minutes=options.drift_minutes, streams=each, seed=options.seed)
        data = describe(material.source, material.clips, procedural=material.procedural)
        result = Evaluation(
            data=data,
            model=self.model,
            seed=options.seed,
            protocols=protocols,
            skipped=self.skipped,
            thresholds=thresholds_of(name, last),
            changes=changes,
            drifts=drifts,
            warnings=(
                *warnings_of(data, material.clips, self.repeats, protocols, notes=material.notes),
                *warnings_of_split(material.splits, self.repeats),
            ),
            libraries=library_versions(),
        )
        return Evaluated(result, self.runs)
