"""`fervor inspect`: what a model file promises."""

import json
from pathlib import Path

import pytest

from bodies import model
from fervor.cli.main import run
from fervor.model import default_model_path
from fervor.server.model_info import describe_model


def test_it_shows_what_matters(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["inspect", str(default_model_path())]) == 0
    shown = capsys.readouterr().out
    metadata = model().metadata
    for expected in (
        metadata.name,
        metadata.version,
        model().sha256,
        "30 Hz",
        metadata.features,
        "h1 [64]",
        "surprise",
    ):
        assert expected in shown
    assert ("not science" in shown) == (metadata.purpose == "demo")


def test_the_packaged_model_is_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect"]) == 0
    assert model().metadata.name in capsys.readouterr().out


def test_as_json_it_is_what_the_service_says(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(describe_model(model()).model_dump_json())


@pytest.mark.parametrize("content", [None, b"", b"no model", b"\x08\x07" * 500])
def test_a_bad_file_is_a_sentence(content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.onnx"
    if content is not None:
        path.write_bytes(content)
    assert run(["inspect", str(path)]) == 65
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(f"fervor: {path} ")
    assert told.err.count("\n") == 1
