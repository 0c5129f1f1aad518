"""What goes wrong on the way to the service and back, told as errors of the fervor tree.

`told` is what the service said, `refused` why there is no connection, `closed` why there is none any more.
"""

import json
import ssl
from collections.abc import Mapping
from errno import ECONNREFUSED
from socket import gaierror
from typing import get_args

from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, InvalidURI

from fervor.errors import (
    AuthError,
    CheckpointMismatch,
    CheckpointUnknown,
    CloseCode,
    EngineError,
    FervorError,
    FrameError,
    IdleTimeout,
    InputError,
    MessageError,
    Overloaded,
    ProtocolError,
    RateExceeded,
    RequestError,
    StartTimeout,
    TooLarge,
    Unreachable,
)
from fervor.protocol.messages import PROTOCOL, Error, ServerMessage
from fervor_client.address import STREAM_PATH

SUBPROTOCOL = f"{PROTOCOL}.json"
"""What this client speaks."""


_KNOWN_TYPES = frozenset(kind.model_fields["type"].default for kind in get_args(get_args(ServerMessage)[0]))

_BY_CODE: Mapping[str, type[FervorError]] = {
    kind.code: kind
    for kind in (
        FervorError,
        InputError,
        FrameError,
        MessageError,
        TooLarge,
        StartTimeout,
        IdleTimeout,
        RateExceeded,
        CheckpointUnknown,
        CheckpointMismatch,
        AuthError,
        Overloaded,
        EngineError,
    )
}

_BY_CLOSE_CODE: Mapping[int, type[FervorError]] = {
    CloseCode.TOO_LARGE: TooLarge,
    CloseCode.OVERLOADED: Overloaded,
    CloseCode.BAD_MESSAGE: ProtocolError,
    CloseCode.AUTH: AuthError,
    CloseCode.CHECKPOINT_UNKNOWN: CheckpointUnknown,
    CloseCode.TIMEOUT: IdleTimeout,
    CloseCode.CHECKPOINT_MISMATCH: CheckpointMismatch,
    CloseCode.RATE: RateExceeded,
}


def told(message: Error) -> FervorError:
    """The error that the service told, as the exception it was there."""
    kind = _BY_CODE.get(message.code, FervorError)
    if kind is MessageError and message.fatal:
        kind = ProtocolError
    error = kind(message.message)
    error.retry_after = message.retry_after
    if isinstance(error, FrameError):
        error.body, error.seq = message.body, message.seq
    return error


def refused(error: Exception, url: str) -> FervorError:
    """Why no session could be opened at `url`."""
    match error:
        case InvalidStatus():
            return _refused_by_status(error, url)
        case InvalidURI():
            return InputError(f"{url!r} is not the address of a stream: {error.msg}")
        case ConnectionClosed():
            return closed(error, url, unanswered=0)
        case TimeoutError():
            sentence = f"no service answered at {url} in time"
        case gaierror():
            sentence = f"no service answers at {url}: the name of the host is not known"
        case ssl.SSLError():
            sentence = f"no secure connection to {url}: {error.strerror or error}"
        case OSError():
            sentence = f"no service answers at {url}: {_os_cause(error)}"
        case InvalidMessage() | EOFError():
            sentence = f"what answers at {url} is not a fervor service: its answer is no HTTP/1.1"
        case _:
            sentence = f"what answers at {url} is not a fervor service: {error}"
    return Unreachable(sentence)


def closed(error: ConnectionClosed | None, url: str, *, unanswered: int) -> FervorError:
    """Why the connection to `url` ended although nobody here closed it; `unanswered` frames were under way."""
    close = error.rcvd if error else None
    cause = f"code {close.code}{f', {close.reason}' if close.reason else ''}" if close else "without a word"
    frames = f"; {unanswered} frame{'s have' if unanswered > 1 else ' has'} no answer" if unanswered else ""
    kind = _BY_CLOSE_CODE.get(close.code, Unreachable) if close else Unreachable
    return kind(f"the service at {url} closed the connection ({cause}){frames}")


def unknown_type(payload: str | bytes) -> str | None:
    """The type of a message that this client does not know, and a newer service may say; None if it is none."""
    try:
        message = json.loads(payload)
    except ValueError:
        return None
    kind = message.get("type") if isinstance(message, dict) else None
    return kind if isinstance(kind, str) and kind not in _KNOWN_TYPES else None


def check_subprotocol(chosen: str | None, url: str) -> None:
    """See that the service agreed to speak our protocol.

    Raises:
        Unreachable: it did not, so it is none of ours.
    """
    if chosen != SUBPROTOCOL:
        raise Unreachable(f"what answers at {url} is a WebSocket, but does not speak {SUBPROTOCOL}")


def _os_cause(error: OSError) -> str:
    """What the system says; asyncio lists one cause per address of a host, of which one is enough."""
    if f"[Errno {ECONNREFUSED}]" in str(error):
        return "connection refused; is `fervor serve` running there?"
    return error.strerror or str(error)


def _refused_by_status(error: InvalidStatus, url: str) -> FervorError:
    response = error.response
    status = response.status_code
    detail = _problem_detail(response.body)
    if status == 503:
        after = response.headers.get("Retry-After", "")
        wait = f"; try again after {after} s" if after.isdecimal() else ""
        full = Overloaded(f"the service at {url} takes no session now: {detail or 'it is overloaded'}{wait}")
        full.retry_after = float(after) if after.isdecimal() else None
        return full
    if status == 401:
        return AuthError(f"the service at {url} wants a token: {detail or 'none came, or a wrong one'}")
    # Servers refuse a WebSocket on a path they don't know with 403 as well as 404.
    if status == 404 or (status == 403 and not url.endswith(STREAM_PATH)):
        return InputError(f"there is no stream at {url}; expected an address that ends in {STREAM_PATH}")
    if 400 <= status < 500:
        return RequestError(f"the service at {url} refused the session: {detail or f'HTTP {status}'}")
    return Unreachable(f"what answers at {url} opens no stream: {detail or f'HTTP {status}'}")


def _problem_detail(body: bytes | bytearray | memoryview | None) -> str | None:
    """The sentence of a problem document (RFC 9457); None if the body is none."""
    try:
        problem = json.loads(bytes(body or b""))
    except ValueError:
        return None
    detail = problem.get("detail") if isinstance(problem, dict) else None
    return str(detail).rstrip(".") if detail else None
