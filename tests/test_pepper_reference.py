"""docs/reference/pepper.md says what the code says: options, fields, keys, columns, states."""

import re

import pytest
import typer
from pydantic import BaseModel

from fervor_pepper.behaviour import Attention, Behaviour, Fillers, Language, Reaction, Timing
from fervor_pepper.feeding import FrameLine
from fervor_pepper.phase import TRANSITIONS
from fervor_pepper.program import app
from fervor_pepper.session_log import COLUMNS, KINDS
from fervor_pepper.study.answers import COLUMNS as ANSWER_COLUMNS
from pages import section, table
from test_docs_reference import compare, rows_of

PAGE = "reference/pepper.md"


def test_every_option_of_the_program() -> None:
    rows = table(section(PAGE, "## `fervor-pepper`"))
    parameters = [parameter for parameter in typer.main.get_command(app).params if parameter.name != "help"]
    compare(rows, [[f"`{parameter.opts[-1]}`"] for parameter in parameters], "fervor-pepper")
    defaults = {row[0]: row[1] for row in rows}
    for parameter in parameters:
        if isinstance(parameter.default, str) and parameter.name != "service":
            assert defaults[f"`{parameter.opts[-1]}`"] == f"`{parameter.default}`"


def test_every_field_of_a_frame_line() -> None:
    compare(table(section(PAGE, "## Frames piped in")), rows_of(FrameLine), "FrameLine")


@pytest.mark.parametrize("model", [Behaviour, Language, Reaction, Fillers, Timing, Attention])
def test_every_key_of_the_behaviour_file(model: type[BaseModel]) -> None:
    compare(table(section(PAGE, f"### {model.__name__}")), rows_of(model), model.__name__)


def test_every_column_and_kind() -> None:
    rows = table(section(PAGE, "## Session log"))
    compare(rows, [[f"`{column}`"] for column in COLUMNS], "session log")
    kinds = next(row[1] for row in rows if row[0] == "`kind`")
    assert tuple(re.findall(r"`(\w+)`", kinds)) == KINDS
    compare(table(section(PAGE, "## Study")), [[f"`{column}`"] for column in ANSWER_COLUMNS], "answers.csv")


def test_every_transition() -> None:
    expected = [[before.name, cue.name, after.name] for (before, cue), after in TRANSITIONS.items()]
    compare(table(section(PAGE, "## What it does when")), expected, "states")
