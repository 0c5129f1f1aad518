"""The contract that travels inside a model file: one JSON value under `METADATA_KEY` in its metadata_props.

The exporter writes it, the service reads it and refuses a file whose contract it can't meet. Inputs and outputs of the
graph are named here once, and states are paired by name (input `h1`, output `next_h1`), never by position.
"""

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from fervor.emotions import EMOTIONS
from fervor.errors import ModelFileError

METADATA_KEY = "fervor"
"""Key of the JSON value in the ONNX file's metadata_props."""

METADATA_VERSION = 1
"""Version of this contract; the service refuses any other."""

ROTATIONS, MASK, EMOTION = "rotations", "mask", "emotion"
"""Graph inputs beside the states: [batch, time, 13, 4] xyzw, [batch, time, 13] (1 observed), [batch, time, 11]."""

INTENSITY, INTENSITY_BY_EMOTION = "intensity", "intensity_by_emotion"
"""Graph outputs beside the states: [batch, time], [batch, time, 11]."""

NEXT = "next_"
"""Prefix of a state's output: `h1` in, `next_h1` out, both [batch, *shape]."""


class StateTensor(BaseModel):
    """One recurrent tensor of a body; all zero at a reset."""

    model_config = ConfigDict(frozen=True)

    name: str
    shape: tuple[int, ...] = Field(description="without the batch axis")


class LevelRule(BaseModel):
    """How an intensity becomes weak or strong; times in seconds."""

    model_config = ConfigDict(frozen=True)

    threshold: dict[str, float] = Field(description="per emotion, and `unknown`; intensity from here on is strong")
    hysteresis: float = Field(0.05, ge=0, lt=0.5, description="half-width of the band in which the level stays")
    dwell_s: float = Field(1.0, ge=0, description="least time a level is kept before it may change")
    source: str = Field("", description="whose predictions the thresholds were chosen by")

    @model_validator(mode="after")
    def _covers_all(self) -> "LevelRule":
        missing = {*EMOTIONS, "unknown"} - self.threshold.keys()
        if missing:
            raise ValueError(f"thresholds are missing for {', '.join(sorted(missing))}")
        return self


class TrainingData(BaseModel):
    """What the network learned from."""

    model_config = ConfigDict(frozen=True)

    description: str
    sha256: str
    recordings: int
    hours: float


class ModelMetadata(BaseModel):
    """Everything the service must know of a model file before it runs it."""

    model_config = ConfigDict(frozen=True)

    metadata_version: Literal[1] = 1
    name: str
    version: str
    purpose: Literal["demo", "research"]
    rig: str = Field("c13", description="name of the rig the rotations are in")
    joints: tuple[str, ...] = Field(description="joint names of the rig, in the order of the joint axis")
    parents: tuple[int, ...]
    quaternion: Literal["xyzw"] = "xyzw"
    rate_hz: float = Field(gt=0, description="rate of the pose grid the network was trained on")
    emotions: tuple[str, ...] = EMOTIONS
    features: Literal["euler", "rot6d+velocity"]
    states: tuple[StateTensor, ...]
    levels: LevelRule
    training: TrainingData
    scores: dict[str, float] = Field(default_factory=dict)
    license: str = "Apache-2.0"
    libraries: dict[str, str] = Field(default_factory=dict, description="versions that made the file")

    @classmethod
    def from_props(cls, props: Mapping[str, str], *, where: str) -> "ModelMetadata":
        """Read the metadata_props of the ONNX file `where`.

        Raises:
            ModelFileError: the key is absent, or its value is not this contract; says what differs.
        """
        raw = props.get(METADATA_KEY)
        if raw is None:
            raise ModelFileError(f"{where} is not a fervor model: its metadata has no {METADATA_KEY!r} entry")
        try:
            return cls.model_validate_json(raw)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"])) or "value"
            raise ModelFileError(f"{where} has metadata this service can't use: {place}: {first['msg']}") from error

    def to_props(self) -> dict[str, str]:
        """The metadata_props entry to write into an ONNX file."""
        return {METADATA_KEY: self.model_dump_json()}
