"""Who may in: tokens of the settings and of a file, with names, replaced while the service runs."""

from pathlib import Path

import pytest
import websockets

from fervor.errors import AuthError, InputError
from fervor.server.tokens import Token, Tokens, parse_tokens
from fervor.settings import Settings, SettingsError
from live import Live, eventually, talk
from test_server_watched_file import replace


def test_a_token_gives_the_name_of_its_holder() -> None:
    tokens = Tokens(parse_tokens("pepper s3cret\n# spare\npepper other\nnameless\n"))
    assert tokens.holder([b"s3cret"]) == tokens.holder([b"other"]) == "pepper"
    assert tokens.holder([b"nameless"]) == "-"
    assert tokens.holder([b"wrong", b"s3cret"]) == "pepper"


@pytest.mark.parametrize("shown", [[], [b""], [b"s3cre"], [b"s3cret "], [b"S3CRET"], [b"pepper"], [b"\xff"]])
def test_nothing_else_does(shown: list[bytes]) -> None:
    with pytest.raises(AuthError):
        Tokens([Token.of("s3cret", "pepper")]).holder(shown)


def test_without_tokens_everybody_may_in() -> None:
    assert Tokens().holder([]) is None


def test_a_token_does_not_show_itself() -> None:
    assert "s3cret" not in repr(Token.of("s3cret", "pepper"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has no token; expected one a line"),
        ("# nothing but a comment", "has no token"),
        ("a\nb c d", "has 3 words in line 2; expected a token, or a name and a token"),
    ],
)
def test_a_file_that_would_let_everybody_in_is_refused(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        parse_tokens(text)


def test_a_bad_file_ends_the_start(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="can't be read"):
        Tokens.from_settings(Settings.load(tokens_file=tmp_path / "nothing"))


async def lets_in(service: Live, token: str) -> bool:
    try:
        async with talk(service, additional_headers={"Authorization": f"Bearer {token}"}) as stream:
            return (await stream.start())["type"] == "session.started"
    except websockets.InvalidStatus as refused:
        return refused.response.status_code != 401


async def test_tokens_are_rotated_while_the_service_runs(
    start_service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fervor.server.watched_file.LOOK_EVERY_S", 0.0)
    path = tmp_path / "tokens"
    replace(path, "pepper old-one")
    service = start_service(tokens_file=path, tokens="always")
    assert await lets_in(service, "old-one")
    assert not await lets_in(service, "new-one")
    async with talk(service, additional_headers={"Authorization": "Bearer old-one"}) as going_on:
        await going_on.start()
        replace(path, "pepper old-one\npepper new-one")
        assert await lets_in(service, "new-one")
        assert await lets_in(service, "old-one")
        replace(path, "pepper new-one")
        assert not await lets_in(service, "old-one")
        assert await lets_in(service, "new-one")
        assert await lets_in(service, "always")
        replace(path, "")  # broken: it would let everybody in
        assert not await lets_in(service, "old-one")
        assert await lets_in(service, "new-one")
        await going_on.send("ping")
        assert (await going_on.hear())["type"] == "pong"  # who is in stays in
    await eventually(lambda: service.service.sessions.open == 0)
