"""What can go wrong, and whose fault it is.

Every message is one sentence: what is wrong, where, and what was expected. Each class carries how the edges tell it:
its wire `code`, HTTP status (RFC 9457 problem), WebSocket close code (only where the connection can't go on) and the
exit code of the command line (sysexits.h).

    FervorError
    ├── InputError            the caller sent something that can't be used
    │   ├── RecordingError    a motion file
    │   ├── ModelFileError    a model file whose contract the service can't meet
    │   ├── DataError         a data set or its manifest
    │   ├── RequestError      an HTTP request body
    │   └── MessageError      a WebSocket message; the session goes on
    │       ├── FrameError    one frame in it; its body goes on with the next
    │       └── ProtocolError the conversation can't go on: told, then closed
    │           ├── TooLarge · StartTimeout · IdleTimeout · RateExceeded
    │           └── CheckpointUnknown · CheckpointMismatch
    ├── AuthError             no or a wrong token
    ├── OriginRefused         a web page of a site that may not use the service
    ├── Overloaded            not now; try again later
    ├── Unreachable           no service answers, or it went away
    └── EngineError           our own fault
"""

from enum import IntEnum
from typing import ClassVar


class CloseCode(IntEnum):
    """WebSocket close codes the service uses (RFC 6455 section 7.4 and our own 44xx)."""

    NORMAL = 1000
    GOING_AWAY = 1001
    TOO_LARGE = 1009
    INTERNAL = 1011
    RESTART = 1012
    OVERLOADED = 1013
    BAD_MESSAGE = 4400
    AUTH = 4401
    CHECKPOINT_UNKNOWN = 4404
    TIMEOUT = 4408
    CHECKPOINT_MISMATCH = 4410
    RATE = 4429


class FervorError(Exception):
    """Root of all errors that fervor raises on purpose."""

    code: ClassVar[str] = "internal"
    http_status: ClassVar[int] = 500
    close_code: ClassVar[CloseCode | None] = CloseCode.INTERNAL
    exit_code: ClassVar[int] = 70

    def __init__(self, message: str, *, retry_after: float | None = None) -> None:
        super().__init__(message)
        self.retry_after = retry_after
        """Seconds after which to try again, where that makes sense."""

    @property
    def message(self) -> str:
        """The sentence."""
        return str(self.args[0])

    @property
    def fatal(self) -> bool:
        """Whether the WebSocket is closed after this error was told."""
        return self.close_code is not None


class InputError(FervorError):
    """The caller sent something that can't be used."""

    code = "bad_input"
    http_status = 422
    close_code: ClassVar[CloseCode | None] = None
    exit_code = 65


class RecordingError(InputError):
    """A motion file that can't be read as a recording."""

    code = "bad_recording"


class ModelFileError(InputError):
    """A model file whose contract the service can't meet."""

    code = "bad_model"
    http_status = 500


class DataError(InputError):
    """A data set on disk, or its manifest, that can't be used."""

    code = "bad_data"


class RequestError(InputError):
    """An HTTP request whose content can't be used."""

    code = "bad_request"


class MessageError(InputError):
    """A WebSocket message that can't be used; the session goes on as if it had not come."""

    code = "bad_message"
    http_status = 400


class FrameError(MessageError):
    """One frame that can't be used; its body goes on with the next frame."""

    code = "bad_frame"

    def __init__(self, message: str, *, body: str | None = None, seq: int | None = None) -> None:
        super().__init__(message)
        self.body = body
        self.seq = seq


class ProtocolError(MessageError):
    """The conversation can't go on after this message."""

    code = "bad_message"
    close_code = CloseCode.BAD_MESSAGE


class TooLarge(ProtocolError):
    """More bytes than the service takes in one piece."""

    code = "too_large"
    http_status = 413
    close_code = CloseCode.TOO_LARGE


class StartTimeout(ProtocolError):
    """No session.start in time."""

    code = "start_timeout"
    http_status = 408
    close_code = CloseCode.TIMEOUT


class IdleTimeout(ProtocolError):
    """Nothing came for too long."""

    code = "idle_timeout"
    http_status = 408
    close_code = CloseCode.TIMEOUT


class RateExceeded(ProtocolError):
    """More frames a second than the service takes from one session."""

    code = "rate_exceeded"
    http_status = 429
    close_code = CloseCode.RATE


class CheckpointUnknown(ProtocolError):
    """A checkpoint that was not signed by a key we know, or is too old."""

    code = "checkpoint_unknown"
    http_status = 404
    close_code = CloseCode.CHECKPOINT_UNKNOWN


class CheckpointMismatch(ProtocolError):
    """A checkpoint of another model or protocol."""

    code = "checkpoint_mismatch"
    http_status = 409
    close_code = CloseCode.CHECKPOINT_MISMATCH


class AuthError(FervorError):
    """No token, or a wrong one."""

    code = "unauthorized"
    http_status = 401
    close_code = CloseCode.AUTH
    exit_code = 77


class OriginRefused(FervorError):
    """A web page of a site that may not use this service."""

    code = "origin_refused"
    http_status = 403
    close_code = CloseCode.AUTH
    exit_code = 77


class Overloaded(FervorError):
    """The service is full; the same request may succeed later."""

    code = "overloaded"
    http_status = 503
    close_code = CloseCode.OVERLOADED
    exit_code = 75


class Unreachable(FervorError):
    """No service answers at the address, or it went away."""

    code = "unreachable"
    http_status = 502
    close_code = None
    exit_code = 69


class EngineError(FervorError):
    """A model run failed: our own fault, not the caller's."""

    code = "engine_failed"
    close_code = None
