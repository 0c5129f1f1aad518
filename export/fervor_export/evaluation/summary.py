"""From the predictions of a protocol to what is said of it, and to the warnings that come before all numbers."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor_export.clip import Clip, digest
from fervor_export.evaluation import ceiling as noise
from fervor_export.evaluation.metrics import Figure, difference, pearson, rounded, score
from fervor_export.evaluation.observed import by_seconds
from fervor_export.evaluation.protocols import BASELINE, NETWORK, PREDICTORS, Run
from fervor_export.evaluation.reliability import reliability
from fervor_export.evaluation.result import (
    Ceilings,
    DataSummary,
    PredictorResult,
    ProtocolResult,
    ThresholdResult,
)
from fervor_export.evaluation.thresholds import choose_thresholds, levels

Floats = npt.NDArray[np.float64]

FEW_ACTORS, FEW_CLIPS = 5, 100
"""Below these, intervals are little worth, and the report says so."""

KNOWS_PEOPLE = 0.15
"""How much better r within emotions may be by recording than with new actors before the report says so."""


def summarise(name: str, title: str, run: Run, *, seed: int = 0) -> ProtocolResult:
    """Everything that is said of a protocol."""
    target = intensities(run.clips)
    felt = np.asarray([clip.emotion != "neutral" for clip in run.clips])
    network = run.predictions[NETWORK]
    return ProtocolResult(
        name=name,
        title=title,
        unit=run.unit,
        folds=int(run.folds.max(initial=0)) + 1,
        predictors=tuple(_predictor(run, name, seed) for name in PREDICTORS if _said(run, name)),
        network_minus_baseline=_ahead(run, BASELINE, seed),
        network_minus_speed=_ahead(run, "speed_by_emotion", seed),
        ceilings=ceilings(run.clips),
        reliability=reliability(network[felt], target[felt]),
        levels=levels(run.clips, network, run.folds),
        seconds=by_seconds(run.clips, run.estimates, run.reading, seed=seed),
        trainings=run.trainings,
    )


def thresholds_of(name: str, run: Run) -> ThresholdResult:
    """Thresholds from a protocol's out-of-fold predictions."""
    chosen = choose_thresholds(run.clips, run.predictions[NETWORK], run.predictions["network_no_emotion"])
    return ThresholdResult(name, chosen.rule, chosen.own, chosen.boundary)


def ceilings(clips: Sequence[Clip]) -> Ceilings:
    """The largest r that anything could have; None where the number of observers is not known of every clip."""
    target, emotions = intensities(clips), np.asarray([clip.emotion for clip in clips])
    if any(clip.observers is None for clip in clips):
        return Ceilings(None, None, None, {})
    observers = np.asarray([clip.observers or 0 for clip in clips], np.int64)
    felt = emotions != "neutral"
    within = {
        emotion: rounded(noise.ceiling(target[mine], observers[mine]))
        for emotion in EMOTIONS
        for mine in [emotions == emotion]
        if mine.any()
    }
    parts = [(value, int((emotions == name).sum())) for name, value in within.items() if name != "neutral"]
    return Ceilings(
        rounded(noise.ceiling(target, observers)),
        rounded(noise.ceiling(target[felt], observers[felt])) if felt.any() else None,
        _fishers_mean([(value, count) for value, count in parts if value is not None and count > 3]),
        within,
    )


def describe(source: str, clips: Sequence[Clip], *, procedural: bool) -> DataSummary:
    """The data set in a few numbers."""
    emotions = Counter(clip.emotion for clip in clips)
    observers = [clip.observers for clip in clips if clip.observers is not None]
    return DataSummary(
        source=source,
        sha256=digest(clips),
        procedural=procedural,
        clips=len(clips),
        recordings=len({clip.name for clip in clips}),
        minutes=round(sum(clip.seconds for clip in clips) / 60, 2),
        actors=dict(sorted(Counter(clip.actor for clip in clips).items())),
        emotions={emotion: emotions[emotion] for emotion in EMOTIONS if emotions[emotion]},
        observers=round(float(np.mean(observers)), 2) if observers else None,
    )


def warnings_of(
    data: DataSummary,
    clips: Sequence[Clip],
    repeats: Mapping[str, str],
    protocols: Sequence[ProtocolResult],
    *,
    notes: Sequence[str] = (),
) -> tuple[str, ...]:
    """What a reader must know before the numbers."""
    return (
        *_of_data(data, clips, repeats),
        *notes,
        *(warning for protocol in protocols for warning in _of_protocol(protocol)),
        *_of_people(protocols),
    )


def warnings_of_split(splits: Mapping[str, Sequence[Clip]], repeats: Mapping[str, str]) -> list[str]:
    """What a split that the data set brings along has on both sides."""
    learned = [*splits.get("train", ()), *splits.get("validation", ())]
    judged = splits.get("test", ())
    if not learned or not judged:
        return []
    actors = sorted({clip.actor for clip in learned} & {clip.actor for clip in judged})
    asked = {repeats.get(clip.name, clip.name) for clip in judged}
    leaked = sum(repeats.get(clip.name, clip.name) in asked for clip in learned)
    shown = ", ".join(actors[:5]) + (", …" if len(actors) > 5 else "")
    said = (
        (actors, f"The data's own split has actors on both sides: {shown}."),
        (leaked, f"The data's own split: {leaked} clips repeat judged recordings and were not learned from."),
    )
    return [sentence for applies, sentence in said if applies]


def _of_data(data: DataSummary, clips: Sequence[Clip], repeats: Mapping[str, str]) -> list[str]:
    pairs = [f"{name} = {first}" for name, first in sorted(repeats.items()) if name != first]
    shown = "; ".join(pairs[:3]) + ("; …" if len(pairs) > 3 else "")
    alike, few = _alike(data.actors), len(data.actors) < FEW_ACTORS
    single = sum(count == 1 for count in data.actors.values())
    missing = ", ".join(emotion for emotion in EMOTIONS if emotion not in data.emotions)
    said = (
        (data.procedural, "Demo: this motion was generated by a program. These numbers say nothing about people."),
        (pairs, f"Recordings that repeat others under another name, {len(pairs)}, were never on both sides: {shown}."),
        (alike, f"Actor names that differ in case or blanks only count as different actors: {alike}."),
        (few, f"Actors: only {len(data.actors)}; intervals over so few are too narrow to be believed."),
        (single, f"Actors with one clip only: {single}."),
        (data.clips < FEW_CLIPS, f"Clips: only {data.clips}."),
        (missing, f"Emotions without clips: {missing}."),
        (
            any(clip.observers is None for clip in clips),
            "The number of observers is not known of every clip: there is no noise ceiling.",
        ),
    )
    return [sentence for applies, sentence in said if applies]


def _of_protocol(protocol: ProtocolResult) -> list[str]:
    hurried, trainings = sum(fold.stopped == "time" for fold in protocol.trainings), len(protocol.trainings)
    said = []
    if hurried:
        said.append(f"time ended {hurried} of {trainings} trainings early; the network could do better")
    if protocol.predictor(NETWORK).scores.r.value is None:
        said.append("the network's predictions, or the labels, are constant; r is not defined")
    behind = protocol.network_minus_speed
    if behind.value is not None and behind.value < 0.0:
        said.append(f"joint speed by emotion, a control, has the better r within emotions by {-behind.value:.2f}")
    return [f"{protocol.title}: {what}." for what in said]


def _of_people(protocols: Sequence[ProtocolResult]) -> list[str]:
    """Whether the network knows people rather than movement."""
    r = {protocol.unit: protocol.predictor(NETWORK).scores.r_within.value for protocol in protocols}
    met, new = r.get("recording"), r.get("actor")
    if met is None or new is None or met - new <= KNOWS_PEOPLE:
        return []
    return [
        f"The network agrees better with actors that it has learned from (r within emotions {met:.2f}) than with new "
        f"ones ({new:.2f}): a robot meets new ones."
    ]


def intensities(clips: Sequence[Clip]) -> Floats:
    """True intensities [clip]."""
    return np.asarray([clip.intensity for clip in clips])


def _predictor(run: Run, name: str, seed: int) -> PredictorResult:
    predicted, target = run.predictions[name], intensities(run.clips)
    folds = (run.folds == fold for fold in np.unique(run.folds))
    return PredictorResult(
        name,
        PREDICTORS[name],
        score(predicted, run.clips, folds=run.folds, seed=seed),
        tuple(rounded(pearson(predicted[fold], target[fold])) for fold in folds),
    )


def _ahead(run: Run, other: str, seed: int) -> Figure:
    """How far the network is ahead within emotions."""
    return difference(run.predictions[NETWORK], run.predictions[other], run.clips, seed=seed)


def _said(run: Run, name: str) -> bool:
    return bool(np.isfinite(run.predictions[name]).any())


def _fishers_mean(parts: Sequence[tuple[float, int]]) -> float | None:
    if not parts:
        return None
    z = np.arctanh(np.minimum([value for value, _ in parts], 1.0 - 1e-9))
    return rounded(float(np.tanh(np.average(z, weights=[count - 3 for _, count in parts]))))


def _alike(actors: Mapping[str, int]) -> str:
    folded = Counter("".join(actor.split()).casefold() for actor in actors)
    return ", ".join(actor for actor in actors if folded["".join(actor.split()).casefold()] > 1)
