"""`fervor serve`: its options are the settings. How it runs: test_server_run."""

import pytest

from fervor.cli.main import run
from fervor.settings import Settings, is_option, option_name


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Settings]:
    """What the service would have been started with."""
    settings: list[Settings] = []
    monkeypatch.setattr("fervor.server.run.run", settings.append)
    return settings


def test_every_setting_but_secrets_is_an_option(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["serve", "--help"]) == 0
    shown = capsys.readouterr().out
    for name in Settings.model_fields:
        assert (f"{option_name(name)} " in shown) == is_option(name), name
    assert "WebSocket sessions at once" in shown


def test_options_win_over_the_environment(started: list[Settings], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_PORT", "9000")
    monkeypatch.setenv("FERVOR_MAX_BODIES", "3")
    assert run(["serve", "--port", "9001", "--log-level", "error"]) == 0
    (settings,) = started
    assert (settings.port, settings.max_bodies, settings.log_level) == (9001, 3, "error")


def test_defaults_without_any(started: list[Settings]) -> None:
    assert run(["serve"]) == 0
    assert started == [Settings.load()]


def test_a_bad_value_is_a_sentence(started: list[Settings], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["serve", "--port", "http"]) == 78
    assert capsys.readouterr().err.startswith("fervor: setting port: input should be a valid integer")
    assert not started
