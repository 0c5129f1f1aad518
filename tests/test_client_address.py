import pytest

from fervor.errors import InputError
from fervor_client.address import DEFAULT_URL, stream_url, without_secrets


@pytest.mark.parametrize("url", ["ws://robot", "ws://robot/", "ws://robot:9000", "wss://robot:9000/"])
def test_an_address_without_path_gets_the_stream_path(url: str) -> None:
    assert stream_url(url) == url.rstrip("/") + "/v1/stream"


@pytest.mark.parametrize("url", [DEFAULT_URL, "ws://[::1]:8080/v1/stream", "wss://robot/behind/v1/stream?region=eu"])
def test_a_complete_address_stays(url: str) -> None:
    assert stream_url(url) == url


@pytest.mark.parametrize(
    "url", ["", "robot", "robot:8080", "http://robot:8080", "ws://", "ws://robot:port", "ws://[::1", "ws://robot#x"]
)
def test_what_is_no_websocket_address_is_refused_in_one_sentence(url: str) -> None:
    with pytest.raises(InputError, match=r"is not the address of a stream; expected one like ws://"):
        stream_url(url)


def test_messages_never_show_a_password() -> None:
    assert without_secrets("wss://me:pass@robot:1/v1/stream?token=x") == "wss://robot:1/v1/stream"
    assert without_secrets(DEFAULT_URL) == DEFAULT_URL
