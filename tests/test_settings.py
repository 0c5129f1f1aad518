"""Settings: where they come from, who wins, and that all of them are documented."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from fervor.protocol.messages import Limits
from fervor.settings import ENV_PREFIX, Settings, SettingsError, is_option, option_name, reference

DOCUMENTED = Path(__file__).resolve().parents[1] / "docs" / "reference" / "settings.md"


def test_defaults_are_safe_ones() -> None:
    settings = Settings.load()
    assert (settings.host, settings.port, settings.model, settings.tokens) == ("127.0.0.1", 8080, None, ())


def test_the_environment_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_MAX_BODIES", "3")
    monkeypatch.setenv("FERVOR_MODEL", "a.onnx")
    assert Settings.load().max_bodies == 3
    assert Settings.load().model == Path("a.onnx")


def test_an_option_wins_over_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_PORT", "9000")
    assert Settings.load(port="9001", host=None).port == 9001


def test_settings_cannot_change() -> None:
    with pytest.raises(ValidationError):
        Settings.load().port = 1  # type: ignore[misc]


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("port", "http", "setting port: input should be a valid integer, unable to parse string as an integer"),
        ("port", "70000", "setting port: input should be less than or equal to 65535"),
        ("log_level", "loud", "setting log_level: input should be 'critical', 'error'"),
        ("capacity", "0", "setting capacity: input should be greater than or equal to 1"),
        ("idle_timeout_s", "-1", "setting idle_timeout_s: input should be greater than 0"),
    ],
)
def test_a_bad_value_is_one_sentence(name: str, value: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENV_PREFIX + name.upper(), value)
    with pytest.raises(SettingsError) as raised:
        Settings.load()
    assert raised.value.message.startswith(expected)
    assert "\n" not in raised.value.message
    assert raised.value.exit_code == 78


def test_an_unknown_option_is_refused() -> None:
    with pytest.raises(SettingsError, match="prot is not a field"):
        Settings.load(prot=1)


def test_tokens_are_split_and_never_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_TOKENS", "alpha, beta ,")
    settings = Settings.load()
    assert [token.get_secret_value() for token in settings.tokens] == ["alpha", "beta"]
    assert "alpha" not in repr(settings)


def test_origins_are_split_and_an_option() -> None:
    assert Settings.load(origins="https://A.example, *").origins == ("https://a.example", "*")
    assert is_option("origins")


def test_keys_have_one_home(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="both given; expected one of them"):
        Settings.load(checkpoint_keys="k" * 20, checkpoint_keys_file=tmp_path)


def test_a_secret_is_no_option() -> None:
    assert not is_option("tokens")
    assert is_option("port")
    assert option_name("max_bodies") == "--max-bodies"


def test_limits_are_those_of_the_settings() -> None:
    assert Settings.load().limits == Limits()
    assert Settings.load(max_bodies=2, idle_timeout_s=5).limits == Limits(max_bodies=2, idle_timeout_s=5)


def test_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        assert field.description, name


def test_every_setting_is_documented() -> None:
    assert reference() in DOCUMENTED.read_text(encoding="utf-8"), "python -m fervor.settings writes the table anew"


def test_a_secret_that_cannot_be_used_is_not_told_back():
    with pytest.raises(SettingsError) as caught:
        Settings.load(checkpoint_keys="tooshort")
    assert caught.value.message == (
        "setting checkpoint_keys: a key has fewer than 16 characters; expected a long random one"
    )
    assert "tooshort" not in repr(Settings.load(checkpoint_keys="tooshort" * 4))
