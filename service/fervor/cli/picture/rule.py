"""How wide the band is in which a level stays: a stream and a score don't say it, the model's full description does."""

from http.client import HTTPException
from urllib.request import Request, urlopen

from pydantic import ValidationError

from fervor.server.model_info import ModelDescription

PATIENCE_S = 5.0
"""How long a service may take to describe its model, seconds."""


def hysteresis_at(base: str, token: str | None) -> float | None:
    """Half-width of the band of the model that a service runs; None where it does not tell.

    A picture does without: whatever is wrong with the service, the command itself says.

    Args:
        base: address of the service, http(s), without a slash at the end.
        token: for a service that wants one.
    """
    request = Request(f"{base}/v1/model")  # noqa: S310  # http(s)
    if token:
        request.add_header("Authorization", f"Bearer {token}")
    try:
        with urlopen(request, timeout=PATIENCE_S) as answer:  # noqa: S310  # http(s)
            return ModelDescription.model_validate_json(answer.read()).metadata.levels.hysteresis
    except (OSError, HTTPException, ValidationError):
        return None
