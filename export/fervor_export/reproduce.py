"""The paper's experiment as one piece of work: check the data, judge by folds, learn from everything, write it down.

All lies in one directory. Trainings are kept there after every epoch, and what a fold's baseline said after every fold,
so whoever is killed goes on there when started again, and ends with the same bits.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from fervor_export.data.dataset import SYNTHETIC, Dataset, load_dataset
from fervor_export.data.loading import Progress
from fervor_export.data.report import html_report
from fervor_export.data.summary import Summary, summarise
from fervor_export.evaluation.evaluate import Evaluated, Options, Watch, evaluate
from fervor_export.evaluation.evaluate import Material as Judged
from fervor_export.evaluation.report import write
from fervor_export.evaluation.splits import MOST_ACTORS
from fervor_export.judgement import out_of_fold
from fervor_export.material import Material
from fervor_export.recipe import Recipe
from fervor_export.run import FOLDS, Run
from fervor_export.train_run import train_on
from fervor_export.watching import Watcher


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is to be reproduced."""

    data: str
    recipe: Recipe
    seed: int
    folds: int
    """Of the protocol by recording."""
    clips: int
    """To synthesise, where the data are."""
    minutes: float | None
    """Of all training."""
    threads: int

    @property
    def command(self) -> str:
        """What to type to have the same again."""
        clips = f" --clips {self.clips}" if self.data == SYNTHETIC else ""
        return (
            f"fervor reproduce {self.data} --recipe {self.recipe.name} --seed {self.seed}{clips} --folds {self.folds} "
            f"--epochs {self.recipe.epochs} --threads {self.threads}"
        )

    def load(self, progress: Progress) -> tuple[Dataset, Summary]:
        """The data set, and what there is to say about it.

        Raises:
            DataError: it can't be used.
        """
        data = load_dataset(self.data, progress=progress, clips=self.clips, seed=self.seed, votes=True)
        return data, summarise(data)

    def trainings(self, data: Dataset) -> int:
        """How many there will be: the folds of all protocols, and the last one."""
        given = bool(data.splits.get("test"))
        return self.folds + min(len({clip.actor for clip in data.clips}), MOST_ACTORS) + given + 1

    def judge(self, data: Dataset, directory: Path, watcher: Watcher, options: Options | None = None) -> Evaluated:
        """The report: folds, leaving actors out, baseline and controls; written down.

        Raises:
            DataError: no protocol can be run with these clips.
        """
        shared = None if self.minutes is None else self.minutes * (1.0 - 1.0 / self.trainings(data))
        judged = evaluate(
            Judged.of(data),
            self.recipe,
            keep=directory / FOLDS,
            options=options or Options(folds=self.folds, seed=self.seed, minutes=shared),
            watch=Watch(lambda what, done, _total: watcher.begin(what, done), watcher.epoch),
        )
        write(judged, directory)
        return judged

    def learn(self, data: Dataset, judged: Evaluated, directory: Path, watcher: Watcher) -> Run:
        """The last training, from everything; written down, with thresholds and scores out of fold."""
        trainings = self.trainings(data)
        watcher.begin("all clips", trainings - 1)
        material = Material.whole(data, self.recipe, seed=self.seed)
        minutes = None if self.minutes is None else self.minutes / trainings
        result = train_on(material, self.recipe, directory, watcher, seed=self.seed, minutes=minutes)
        run = Run(
            self.command, material, self.recipe, self.seed, self.threads, result, out_of_fold(judged.runs)
        )  # fmt: skip
        run.write(directory)
        return run


def write_data_report(data: Dataset, summary: Summary, directory: Path) -> None:
    """What `fervor data check` says of the data, as `data.html` and `data.json`."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "data.html").write_text(html_report(data, summary), encoding="utf-8")
    content = summary.as_dict() | {"findings": [asdict(finding) for finding in data.findings]}
    (directory / "data.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
