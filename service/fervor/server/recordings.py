"""Recordings scored as the service would: for uploads and for the command line alike."""

import math
from collections.abc import Callable, Sequence

from fervor.metadata import ModelMetadata
from fervor.recordings.recording import Recording
from fervor.scoring.scorer import Scorer
from fervor.scoring.take import Take
from fervor.server.scoring_models import FileOptions, SequenceScore
from fervor.session.body import Terms
from fervor.session.events import Source


def score_recordings(
    scorer: Scorer,
    metadata: ModelMetadata,
    recordings: Sequence[Recording],
    options: FileOptions,
    *,
    progress: Callable[[int], None] | None = None,
) -> list[SequenceScore]:
    """Score recordings of any kinds together; the emotion holds from the first frame to the last.

    Args:
        scorer: of the model described by `metadata`.
        metadata: the model's.
        recordings: what to score.
        options: how; `filename` and `skeleton` are for who reads the files.
        progress: called with the number of frames done since the last call.

    Raises:
        InputError: an emotion that is not known.
        EngineError: the model failed.
    """
    takes = [_take(recording, options) for recording in recordings]
    if not takes:
        return []
    terms = Terms(
        metadata=metadata,
        source=_source(recordings[0]),
        clock=options.clock,
        memory=options.memory,
        emotion_ttl_s=math.inf,
        by_emotion=options.by_emotion,
    )
    return [SequenceScore.of(scored, options.detail) for scored in scorer.score(takes, terms, progress=progress)]


def _take(recording: Recording, options: FileOptions) -> Take:
    return Take(
        name=recording.name,
        times=recording.times,
        rotations=recording.rotations,
        observed=recording.observed,
        emotion=options.emotion,
        source=_source(recording),
    )


def _source(recording: Recording) -> Source:
    return Source(recording.skeleton, recording.axes)
