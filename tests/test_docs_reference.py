"""The reference says what the code says: every field, route, error, option and number of it, and no other.

Tables are compared with what they describe; their last column is prose. Where one differs, the rows it should have are
shown.
"""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import httpx
import pytest
import typer
from pydantic import BaseModel

import fervor
import fervor_bench
import fervor_client
import fervor_pepper
from fervor.cli.commands import build_app, find_commands
from fervor.errors import CloseCode, FervorError
from fervor.metadata import LevelRule, ModelMetadata, StateTensor, TrainingData
from fervor.protocol import messages
from fervor.protocol.codec import CODECS
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.server import watch_messages
from fervor.session.state import TRANSITIONS
from fervor.settings import Settings
from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.landmarks import LANDMARKS
from pages import names, read, section, table


def compare(actual: list[list[str]], expected: list[list[str]], where: str) -> None:
    """The first columns of a table with what they should be; the rest is prose."""
    columns = len(expected[0])
    shown = "\n".join(f"| {' | '.join(row)} | |" for row in expected)
    assert [row[:columns] for row in actual] == expected, f"{where} should have the rows\n{shown}"


# --- tables of fields -------------------------------------------------------------------------------------------------


def kind(schema: dict[str, Any], defs: dict[str, Any]) -> str:
    """The type of a JSON schema in few words."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return kind(defs[name], defs) if "enum" in defs[name] else str(name)
    if options := schema.get("anyOf") or schema.get("oneOf"):
        return " or ".join(kind(option, defs) for option in options)
    if values := schema.get("enum") or schema.get("const"):
        return ", ".join(f"`{value}`" for value in (values if isinstance(values, list) else [values]))
    return _plain_kind(schema, defs)


def _plain_kind(schema: dict[str, Any], defs: dict[str, Any]) -> str:
    match schema.get("type"):
        case "array" if "prefixItems" in schema:
            return f"array of {len(schema['prefixItems'])} {kind(schema['prefixItems'][0], defs)}s"
        case "array":
            inner = kind(schema["items"], defs)
            inner = f"({inner})" if "anyOf" in schema["items"] else inner
            return f"array of {inner}{_bounds(schema, 'minItems', 'maxItems', ' entries')}"
        case "object":
            return f"object of {kind(schema.get('additionalProperties', {}), defs)}"
        case "string":
            return f"string{_bounds(schema, 'minLength', 'maxLength', ' characters')}"
        case other:
            return f"{other}{_bounds(schema, 'minimum', 'maximum', '')}"


def _bounds(schema: dict[str, Any], least: str, most: str, unit: str) -> str:
    limits = (("≥", least), (">", "exclusiveMinimum"), ("≤", most), ("<", "exclusiveMaximum"))
    said = [f"{sign} {_number(schema[key])}" for sign, key in limits if key in schema]
    return f" {', '.join(said)}{unit}" if said else ""


def _number(value: float) -> str:
    return "2^53" if value == 2**53 else f"{value:g}"


def fields(schema: dict[str, Any], defs: dict[str, Any]) -> list[list[str]]:
    """Name, type and default of each field of an object."""
    rows = []
    for name, field in schema["properties"].items():
        if name in schema.get("required", ()):
            default = "required"
        else:
            default = f"`{field['default']}`" if field.get("default") not in (None, [], {}, "") else "-"
        rows.append([f"`{name}`", kind(field, defs), default.replace("True", "true").replace("False", "false")])
    return rows


def rows_of(model: type[BaseModel]) -> list[list[str]]:
    schema = model.model_json_schema()
    rows = fields(schema, schema.get("$defs", {}))
    return [row for row in rows if row[0] != "`type`"]


def members(union: Any) -> dict[str, type[BaseModel]]:
    """The messages of a union by their type."""
    classes = get_args(get_args(union)[0])
    return {cls.model_fields["type"].default: cls for cls in classes}


MESSAGES = members(messages.ClientMessage) | members(messages.ServerMessage)
PARTS = {
    "ModelInfo": messages.ModelInfo,
    "Limits": messages.Limits,
    "Totals": messages.Totals,
    "Resumed": messages.Resumed,
    "SkeletonSpec": SkeletonSpec,
}


@pytest.mark.parametrize("name", [*MESSAGES, *PARTS])
def test_protocol_describes_every_field(name: str) -> None:
    model = MESSAGES.get(name) or PARTS[name]
    text = section("reference/protocol.md", f"### `{name}`" if name in MESSAGES else f"### {name}")
    if rows := rows_of(model):
        compare(table(text), rows, name)


WATCH = {
    "`look`": watch_messages.Look,
    "BodyName": watch_messages.BodyName,
    "`watch.started`": watch_messages.WatchStarted,
    "`snapshot`": watch_messages.Snapshot,
    "SeenSession": watch_messages.SeenSession,
    "SeenBody": watch_messages.SeenBody,
}


@pytest.mark.parametrize("name", WATCH)
def test_page_describes_every_field_of_its_line(name: str) -> None:
    compare(table(section("reference/page.md", f"### {name}")), rows_of(WATCH[name]), name)


def test_protocol_describes_no_message_that_is_not_there() -> None:
    told = re.findall(r"^### `([\w.]+)`$", read("reference/protocol.md"), re.MULTILINE)
    assert sorted(told) == sorted(MESSAGES)


def test_protocol_says_which_message_is_allowed_when() -> None:
    rows = table(section("reference/protocol.md", "## States"))
    expected = {(state.name, message, after.name) for (state, message), after in TRANSITIONS.items()}
    told = {(state, message, after) for state, sent, after in rows for message in re.findall(r"`([\w.]+)`", sent)}
    assert told == expected


def test_protocol_describes_every_encoding() -> None:
    assert names(table(section("reference/protocol.md", "## Opening"))) == set(CODECS)


def test_protocol_describes_flags_and_statuses() -> None:
    assert names(table(section("reference/protocol.md", "## Flags"))) == set(get_args(messages.Flag))
    assert names(table(section("reference/protocol.md", "## Status"))) == set(get_args(messages.Status))


@pytest.mark.parametrize("model", [ModelMetadata, StateTensor, LevelRule, TrainingData])
def test_model_file_describes_every_field(model: type[BaseModel]) -> None:
    compare(table(section("reference/model-file.md", f"### {model.__name__}")), rows_of(model), model.__name__)


# --- HTTP -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def openapi(http: httpx.Client) -> dict[str, Any]:
    document: dict[str, Any] = http.get("/openapi.json").json()
    return document


def test_http_describes_every_route_parameter_and_status(openapi: dict[str, Any]) -> None:
    told = set(re.findall(r"^## ([A-Z]+ /\S+)$", read("reference/http.md"), re.MULTILINE))
    routes = {
        f"{method.upper()} {path}": operation
        for path, methods in openapi["paths"].items()
        for method, operation in methods.items()
    }
    assert told == set(routes)
    for route, operation in routes.items():
        text = section("reference/http.md", f"## {route}")
        statuses = re.search(r"^Answers: (.+?)\n\n", text + "\n", re.MULTILINE | re.DOTALL)
        assert statuses, route
        assert set(re.findall(r"\b\d{3}\b", statuses[1])) == set(operation["responses"]), route
        if parameters := operation.get("parameters"):
            defs = openapi["components"]["schemas"]
            rows = fields({"properties": {entry["name"]: entry["schema"] for entry in parameters}}, defs)
            compare(table(text), rows, route)


def test_http_describes_every_schema(openapi: dict[str, Any]) -> None:
    schemas = openapi["components"]["schemas"]
    elsewhere = read("reference/protocol.md") + read("reference/model-file.md")
    for name, schema in schemas.items():
        if "enum" in schema or re.search(rf"^### `?{name}`?$", elsewhere, re.MULTILINE) or name == "Estimate":
            continue
        compare(table(section("reference/http.md", f"### {name}")), fields(schema, schemas), name)


def test_http_describes_every_metric(http: httpx.Client) -> None:
    told = names(table(section("reference/http.md", "## GET /metrics")))
    shown = set(re.findall(r"^# TYPE (\w+)", http.get("/metrics").text, re.MULTILINE))
    assert told == {name for name in shown if not name.endswith("_created")}


# --- errors -----------------------------------------------------------------------------------------------------------


def all_errors(root: type[FervorError] = FervorError) -> Iterator[type[FervorError]]:
    yield root
    for kind_ in root.__subclasses__():
        if kind_.__module__.startswith("fervor"):
            yield from all_errors(kind_)


def test_errors_are_all_there() -> None:
    for package in (fervor, fervor_client, fervor_pepper, fervor_bench):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith(("scoring_worker", "qi_robot")):  # a program of its own; where qi is missing
                importlib.import_module(found.name)
    expected = [
        [
            f"`{error.__name__}`",
            f"`{error.code}`",
            str(error.http_status),
            str(int(error.close_code)) if error.close_code else "-",
            str(error.exit_code),
        ]
        for error in dict.fromkeys(all_errors())
    ]
    rows = table(section("reference/errors.md", "## The tree"))
    compare(sorted(rows), sorted(expected), "errors.md")


def test_close_codes_are_all_there() -> None:
    told = names(table(section("reference/errors.md", "## Close codes")))
    assert told == {str(int(code)) for code in CloseCode}


# --- command line, settings, client, skeletons ------------------------------------------------------------------------


def test_cli_describes_every_command_and_option() -> None:
    group = typer.main.get_command(build_app([]))
    told = re.findall(r"^## `fervor (\w+)`$", read("reference/cli.md"), re.MULTILINE)
    assert sorted(told) == sorted(find_commands())
    settings = read("reference/settings.md")
    for name, command in group.commands.items():  # type: ignore[attr-defined]
        if name == "serve":
            assert all(option in settings for parameter in command.params for option in parameter.opts)
            continue
        rows = table(section("reference/cli.md", f"## `fervor {name}`"))
        parameters = [
            parameter
            for part in getattr(command, "commands", {name: command}).values()  # a group's are those of its parts
            for parameter in part.params
            if parameter.name != "help"
        ]
        expected = [
            [f"`{parameter.opts[-1]}`" if parameter.opts[0].startswith("-") else f"`{parameter.name}`"]
            for parameter in parameters
        ]
        compare(sorted(rows), sorted(expected), name)
        for parameter in parameters:
            if isinstance(parameter.default, int | float | str | Path) and not isinstance(parameter.default, bool):
                row = next(row for row in rows if row[0] == f"`{parameter.opts[-1]}`")
                assert row[1] == f"`{parameter.default}`", (name, parameter.name, parameter.default)


def test_settings_are_all_there() -> None:
    told = names(table(read("reference/settings.md")))
    assert told == {f"FERVOR_{name.upper()}" for name in Settings.model_fields}


def test_python_client_describes_arguments_and_methods() -> None:
    text = section("reference/python-client.md", "## `connect`")
    given = set(inspect.signature(fervor_client.sync.connect).parameters) - {"options"}
    assert names(table(text)) == given
    listed = re.search(r"by keyword:\n(.+?)\n\n", text, re.DOTALL)
    assert listed
    assert set(re.findall(r"`(\w+)`", listed[1])) == set(fervor_client.Options.__annotations__)
    rows = table(section("reference/python-client.md", "## `Session`"))
    twin = fervor_client.sync.Session
    there = {name for name in dir(twin) if not name.startswith("_") and name != "start"}
    assert {row[0].strip("`").partition("(")[0] for row in rows} == there


def test_skeletons_are_all_there() -> None:
    rows = table(section("reference/skeletons-and-rotations.md", "## Skeletons by name"))
    expected = [
        [
            f"`{known.name}`",
            known.title,
            str(len(known.joints)),
            known.axes,
            known.quaternion,
            str(sum(known.sees)),
            "yes" if known.noisy else "-",
        ]
        for known in SKELETONS.values()
    ]
    compare(rows, expected, "skeletons")
    rows = table(section("reference/skeletons-and-rotations.md", "### Landmark sensors"))
    points = [
        [f"`{known.name}`", known.title, str(len(known.joints)), str(sum(known.sees))] for known in LANDMARKS.values()
    ]
    compare(rows, points, "landmark sensors")


def test_numbers_of_a_live_body_are_those_of_the_code() -> None:
    for name, value, *_ in table(section("explanation/live-body.md", "## The numbers")):
        module, _, constant = name.strip("`").rpartition(".")
        actual = getattr(importlib.import_module(module), constant)
        assert float(value.split()[0]) == pytest.approx(float(actual)), name
