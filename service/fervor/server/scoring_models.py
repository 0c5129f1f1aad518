"""The bodies of `/v1/score`: sequences of frames in, estimates or summaries out.

The words are those of the stream: a sequence is a body, its frames are `frame` messages without their envelope. Unknown
fields are refused, so that a misspelt option is told and not ignored.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from fervor.levels import Level
from fervor.protocol.messages import (
    Clock,
    Emotion,
    Estimate,
    Joints,
    Mask,
    Memory,
    ModelInfo,
    Quaternions,
    Raw,
    Vectors,
)
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.scoring.scored import Scored, summarise
from fervor.skeletons.skeleton import Axes, QuaternionOrder

Detail = Literal["summary", "frames"]
"""`summary`: a few numbers a sequence; `frames`: all its estimates too."""

MULTIPART = "multipart/form-data"
"""Content type of a form with files."""

_IDENTITY = [0.0, 0.0, 0.0, 1.0]

EXAMPLE: dict[str, Any] = {
    "skeleton": "c13",
    "sequences": [
        {
            "name": "wave",
            "emotion": "joy",
            "frames": [{"t": 0.0, "q": [_IDENTITY] * 13}, {"t": 0.0333, "q": [_IDENTITY] * 13}],
        }
    ],
}


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ScoreFrame(_Strict):
    """One timestamped pose."""

    t: float | None = Field(None, allow_inf_nan=False, description="seconds; needed by clock `time`")
    q: Quaternions | None = Field(None, description="one quaternion a joint; null where untracked")
    p: Vectors | None = Field(None, description="landmark sensors, in place of q: one position a joint")
    mask: Mask | None = Field(None, description="false where untracked")


class _Sequence(_Strict):
    name: str = Field("", max_length=256)
    emotion: Emotion | None = Field(None, description="holds for the whole sequence; absent: unknown")


class ScoreSequence(_Sequence):
    """One take of one body."""

    frames: tuple[ScoreFrame, ...] = Field(min_length=1, fail_fast=True)


class Manner(_Strict):
    """How to score, and what to answer."""

    clock: Clock = Field("time", description="`time`: by the frames' times; `frames`: each frame is one step")
    memory: Memory = "staggered"
    by_emotion: bool = Field(default=False, description="estimates carry the intensity under every emotion too")
    detail: Detail = Field("summary", description="`frames`: all estimates too")


class PackedScoreFrame(_Strict):
    """A frame in MessagePack: joints may be raw, as on the stream."""

    t: float | None = Field(None, allow_inf_nan=False)
    q: Quaternions | Raw | None = None
    p: Vectors | Raw | None = None
    mask: Mask | None = None


class PackedScoreSequence(_Sequence):
    """A sequence in MessagePack."""

    frames: tuple[PackedScoreFrame, ...] = Field(min_length=1, fail_fast=True)


class ScoreTerms(Manner):
    """What holds for all sequences of a request."""

    skeleton: str | SkeletonSpec = Field("c13", description="name from /v1/skeletons, or one of your own")
    axes: Axes | None = Field(None, description="default: what the skeleton's sensor gives")
    quaternion: QuaternionOrder | None = Field(None, description="default: what the skeleton's sensor gives")
    joints: Joints | None = Field(None, description="joints sent, in this order; others count as untracked")
    nominal_hz: float | None = Field(None, gt=0, le=1000, description="the sensor's rate; used by clock `frames`")


class ScoreRequest(ScoreTerms):
    """One or many sequences of frames of one kind of sensor."""

    model_config = ConfigDict(json_schema_extra={"example": EXAMPLE})

    sequences: tuple[ScoreSequence, ...] = Field(min_length=1, fail_fast=True)


class PackedScoreRequest(ScoreTerms):
    """A request in MessagePack."""

    sequences: tuple[PackedScoreSequence, ...] = Field(min_length=1, fail_fast=True)


class FileOptions(Manner):
    """What goes with uploaded recordings, as query or as fields of the form."""

    emotion: str | None = Field(None, description="holds for the whole recording; absent: unknown")
    skeleton: str | None = Field(None, description="for tables that don't name theirs; BVH and MVNX bring their own")
    filename: str | None = Field(None, description="says the kind of file where the body is the file itself")


class IntensitySummary(_Strict):
    """Intensities of a sequence after its warm-up (or in it, if there is no more); null where there was no pose."""

    mean: float | None
    peak: float | None
    last: float | None


Share = Annotated[float, Field(ge=0, le=1)]


class SequenceScore(_Strict):
    """A scored sequence."""

    name: str
    emotion: str = Field(description="the label in force at the end, or `unknown`")
    frames: int
    duration_s: float = Field(description="seconds from the first frame to the last")
    intensity: IntensitySummary
    strong: Share = Field(description="share of the frames whose level is strong")
    level: Level | None = Field(description="at the end")
    estimates: tuple[Estimate, ...] | None = Field(None, description="with detail `frames`: one a frame")

    @classmethod
    def of(cls, scored: Scored, detail: Detail) -> "SequenceScore":
        """The score of a sequence from all its estimates."""
        summary = summarise(scored)
        return cls(
            name=summary.name,
            emotion=summary.emotion,
            frames=summary.frames,
            duration_s=summary.duration_s,
            intensity=IntensitySummary(mean=summary.mean, peak=summary.peak, last=summary.last),
            strong=summary.strong,
            level=summary.level,
            estimates=tuple(scored.estimates()) if detail == "frames" else None,
        )


class ScoreResponse(_Strict):
    """The answer to a scoring request, sequences in the order of the request."""

    model: ModelInfo
    fingerprint: str = Field(description="services with equal fingerprints give equal results, to the bit")
    sequences: tuple[SequenceScore, ...]
