"""Sheets become tables of a terminal, and a page."""

import io
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from fervor_bench.machine import Gaps, Interruptions, describe_machine
from fervor_bench.plan import Plan
from fervor_bench.report import as_table, write_markdown
from fervor_bench.results import Breakdown, Results
from fervor_bench.sheets import Sheet
from fervor_bench.stages import Stage


def test_a_table_has_all_cells() -> None:
    console = Console(width=80, file=io.StringIO(), record=True)
    console.print(as_table(Sheet("few words", ("who", "what"), (("one", "1.0"), ("two", "2.0")))))
    text = console.export_text()
    assert all(word in text for word in ("few words", "who", "what", "one", "1.0", "two", "2.0"))


def test_a_page_has_a_table_a_sheet_and_says_what_was_left_out(tmp_path: Path) -> None:
    path = tmp_path / "results.md"
    gaps = Interruptions(2, Gaps(9.9, 0.01, 0.01), Gaps(0.0, 0.0, 0.0))
    results = Results(
        machine=replace(describe_machine(), interruptions=gaps),
        plan=Plan(),
        standings=[],
        left_out=["floor: no C compiler"],
        breakdowns=[Breakdown("fervor, json", 64, 80.0, (Stage("model", 0.5), Stage("session", 0.5)))],
    )
    write_markdown(results, path)
    lines = path.read_text(encoding="utf-8").splitlines()
    at = lines.index("## Stages of a frame: fervor, json, 64 sessions, 80.0 µs")
    assert lines[at + 1 : at + 6] == [
        "",
        "| stage | share | µs |",
        "|---|---|---|",
        "| model | 50% | 40.0 |",
        "| session | 50% | 40.0 |",
    ]
    assert lines[-1] == "- floor: no C compiler"
    assert results.machine.sentence in lines[2]
    assert lines[4] == f"{gaps.sentence}."
