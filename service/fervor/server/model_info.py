"""What clients are told of the model that answers them: in short with every session, in full on request."""

from pydantic import BaseModel, Field

from fervor.metadata import ModelMetadata
from fervor.model import Model
from fervor.protocol.messages import ModelInfo


class ModelDescription(BaseModel):
    """A model file, in full."""

    sha256: str = Field(description="of the model file, in hexadecimal")
    fingerprint: str = Field(description="services with equal fingerprints give equal results, to the bit")
    metadata: ModelMetadata


def describe_model(model: Model) -> ModelDescription:
    """The full description of a model."""
    return ModelDescription(sha256=model.sha256, fingerprint=model.fingerprint, metadata=model.metadata)


def model_info(model: Model) -> ModelInfo:
    """The short description of a model."""
    metadata = model.metadata
    return ModelInfo(
        name=metadata.name,
        version=metadata.version,
        purpose=metadata.purpose,
        sha256=model.sha256,
        rate_hz=metadata.rate_hz,
        emotions=metadata.emotions,
        thresholds=metadata.levels.threshold,
    )
