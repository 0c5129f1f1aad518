import ssl
from socket import gaierror

import pytest
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosedError, InvalidMessage, InvalidStatus, InvalidURI
from websockets.frames import Close
from websockets.http11 import Response

from fervor.errors import (
    AuthError,
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
    Unreachable,
)
from fervor.protocol.messages import Error
from fervor_client.failures import check_subprotocol, closed, refused, told

URL = "ws://robot:8080/v1/stream"


@pytest.mark.parametrize(
    ("code", "fatal", "kind"),
    [
        ("bad_frame", False, FrameError),
        ("bad_message", False, MessageError),
        ("bad_message", True, ProtocolError),
        ("bad_input", False, InputError),
        ("rate_exceeded", True, RateExceeded),
        ("unauthorized", True, AuthError),
        ("overloaded", False, Overloaded),
        ("engine_failed", False, EngineError),
        ("from_the_future", False, FervorError),
    ],
)
def test_what_the_service_told_is_raised_as_it_was_there(code: str, fatal: bool, kind: type[FervorError]) -> None:
    error = told(Error(code=code, message="a sentence", fatal=fatal, body="a", seq=3, retry_after=2.0))
    assert type(error) is kind
    assert (error.message, error.retry_after) == ("a sentence", 2.0)
    if isinstance(error, FrameError):
        assert (error.body, error.seq) == ("a", 3)


def status(code: int, body: bytes = b"", **headers: str) -> InvalidStatus:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return InvalidStatus(Response(code, "reason", Headers(named), body))


@pytest.mark.parametrize(
    ("error", "kind", "sentence"),
    [
        (ConnectionRefusedError(111, "Connect call failed"), Unreachable, "is `fervor serve` running there"),
        (OSError("Multiple exceptions: [Errno 111] Connect, [Errno 111] x"), Unreachable, "connection refused"),
        (OSError(113, "No route to host"), Unreachable, "No route to host"),
        (gaierror(-2, "Name or service not known"), Unreachable, "name of the host"),
        (TimeoutError(), Unreachable, "in time"),
        (ssl.SSLError(1, "WRONG_VERSION_NUMBER"), Unreachable, "no secure connection"),
        (InvalidMessage("did not receive a valid HTTP response"), Unreachable, "is no HTTP/1.1"),
        (InvalidURI(URL, "odd"), InputError, "odd"),
        (status(404), InputError, "there is no stream at"),
        (status(401, b'{"detail": "The token is wrong."}'), AuthError, "The token is wrong"),
        (status(401), AuthError, "wants a token"),
        (status(403), RequestError, "HTTP 403"),
        (status(400, b'{"detail": "Subprotocol x is not known."}'), RequestError, "Subprotocol x is not known"),
        (status(400, b"[1]"), RequestError, "HTTP 400"),
        (status(200, b"<html>"), Unreachable, "HTTP 200"),
        (status(500), Unreachable, "HTTP 500"),
    ],
)
def test_a_refused_connection_is_one_sentence_with_the_address(
    error: Exception, kind: type[FervorError], sentence: str
) -> None:
    said = refused(error, URL)
    assert type(said) is kind
    assert sentence in said.message
    assert URL in said.message
    assert "\n" not in said.message


def test_a_path_that_is_not_known_is_told_as_such_whatever_the_status() -> None:
    for code in (403, 404):
        said = refused(status(code), "ws://robot/strem")
        assert isinstance(said, InputError)
        assert said.message == "there is no stream at ws://robot/strem; expected an address that ends in /v1/stream"


def test_an_overloaded_service_says_when_to_try_again() -> None:
    said = refused(status(503, b'{"detail": "All 64 sessions are taken."}', Retry_After="7"), URL)
    assert isinstance(said, Overloaded)
    assert said.retry_after == 7.0
    assert said.message.endswith("All 64 sessions are taken; try again after 7 s")


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (1001, Unreachable),
        (1012, Unreachable),
        (1013, Overloaded),
        (4400, ProtocolError),
        (4401, AuthError),
        (4408, IdleTimeout),
        (4429, RateExceeded),
    ],
)
def test_a_closed_connection_tells_code_and_reason(code: int, kind: type[FervorError]) -> None:
    said = closed(ConnectionClosedError(Close(code, "because"), None), URL, unanswered=2)
    assert type(said) is kind
    assert said.message == f"the service at {URL} closed the connection (code {code}, because); 2 frames have no answer"


def test_a_cut_connection_is_told_too() -> None:
    said = closed(ConnectionClosedError(None, None), URL, unanswered=1)
    assert isinstance(said, Unreachable)
    assert said.message == f"the service at {URL} closed the connection (without a word); 1 frame has no answer"


def test_a_websocket_of_somebody_else_is_none_of_ours() -> None:
    check_subprotocol("fervor.v1.json", URL)
    with pytest.raises(Unreachable, match=r"does not speak fervor\.v1\.json"):
        check_subprotocol(None, URL)
