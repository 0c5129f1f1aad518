"""`python -m bench.invariance` runs, and docs/reference/invariance.md shows all that it prints."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.landmarks import LANDMARKS
from pages import ROOT, read, table
from program import write_bvh

NOTHING = "< 0.0001"


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The script, with takes of two seconds."""
    monkeypatch.setattr(sys, "path", [*sys.path])  # it appends to it
    spec = importlib.util.spec_from_file_location("bench_invariance", ROOT / "bench" / "invariance.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "SECONDS", 2.0)
    return module


def tables(text: str) -> list[list[list[str]]]:
    """The cells of all tables, each with its head."""
    found = re.findall(r"(^\|.*\n)\|[-|]+\|\n((?:\|.*\n)+)", text, re.MULTILINE)
    return [[[cell.strip() for cell in line.split("|")[1:-1]] for line in (head + rows).splitlines()]
            for head, rows in found]  # fmt: skip


def test_it_prints_the_tables_of_the_page(
    bench: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_bvh(tmp_path / "wave.bvh", seconds=2.5)
    monkeypatch.setattr(sys, "argv", ["invariance", str(tmp_path)])
    bench.main()
    printed, shown = tables(capsys.readouterr().out), tables(read("reference/invariance.md"))
    assert [made[0] for made in printed] == [page[0] for page in shown], "the tables have the same columns"
    sensors, streams, files, overall = ([row[0] for row in made[1:]] for made in printed)
    assert [row[0] for row in shown[0][1:]] == sensors
    assert [row[0] for row in shown[1][1:]] == streams
    assert set(files) == {"wave"}
    assert [row[0] for row in shown[3][1:]] == overall


def test_the_page_tells_of_every_sensor_and_that_rotations_lose_nothing() -> None:
    rows = {row[0].strip("`"): row for row in table(read("reference/invariance.md"))}
    assert set(rows) == {*SKELETONS, *LANDMARKS} - {"c13"}
    for name in SKELETONS.keys() - {"c13"}:
        assert rows[name][2:4] == [NOTHING, NOTHING], name
