"""Errors as a client is told of them."""

from fervor.errors import FervorError
from fervor.protocol.lean_frame import LeanFrame
from fervor.protocol.messages import Error, Frame


def refusal(error: FervorError, frame: Frame | LeanFrame | None = None) -> Error:
    """The wire form of an error; one that a frame caused names the frame and ends nothing."""
    return Error(
        code=error.code,
        message=error.message,
        fatal=error.fatal and frame is None,
        body=frame.body if frame else getattr(error, "body", None),
        seq=frame.seq if frame else getattr(error, "seq", None),
        retry_after=error.retry_after,
    )
