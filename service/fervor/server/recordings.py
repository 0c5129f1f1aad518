"""A recording scored as the service would: for uploads and for the command line alike."""

import math
from collections.abc import Callable

from fervor.metadata import ModelMetadata
from fervor.recordings.recording import Recording
from fervor.scoring import Scorer, Take
from fervor.server.scoring_models import FileOptions, SequenceScore
from fervor.session.body import Terms
from fervor.session.events import Source


def score_recording(
    scorer: Scorer,
    metadata: ModelMetadata,
    recording: Recording,
    options: FileOptions,
    *,
    progress: Callable[[int], None] | None = None,
) -> SequenceScore:
    """Score one recording; its emotion holds from the first frame to the last.

    Args:
        scorer: of the model described by `metadata`.
        metadata: the model's.
        recording: what to score.
        options: how; `filename` and `skeleton` are for who reads the file.
        progress: called with the number of frames done since the last call.

    Raises:
        InputError: an emotion that is not known.
        EngineError: the model failed.
    """
    terms = Terms(
        metadata=metadata,
        source=Source(recording.skeleton, recording.axes),
        clock=options.clock,
        memory=options.memory,
        emotion_ttl_s=math.inf,
        by_emotion=options.by_emotion,
    )
    take = Take(recording.name, recording.times, recording.rotations, recording.observed, options.emotion)
    return SequenceScore.of(take.name, scorer.score([take], terms, progress=progress)[0], options.detail)
