"""The documentation is true: its code runs, and its links lead somewhere. Its tables: test_docs_reference.py.

Rules. Blocks of a page run in order, in a folder with a few recordings, against a real service: its address stands in
for `SERVICE` in the text, and nothing else is changed. Python blocks share one namespace; what one prints must be what
a `text` block right below says. Commands that don't end soon are only parsed, by the program itself. Lines of `json`
blocks are messages of the protocol. JavaScript is run by test_js_docs.py.
"""

import io
import os
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import typer
from pydantic import TypeAdapter

from fervor.cli.commands import build_app
from fervor.cli.main import run as run_fervor
from fervor.protocol.messages import ClientMessage, ServerMessage
from fervor_pepper.program import app as pepper
from live import Live
from pages import DOCS, PAGES, ROOT, Block, blocks, headings, read
from ros_commands import check_ros

SERVICE = "127.0.0.1:8080"
SAMPLE = ROOT / "service" / "fervor" / "samples" / "joy.bvh"
RECORDINGS = ("walk.bvh", "run.bvh")
"""Recordings of the reader's, in the pages."""

LONG = frozenset({"serve", "demo", "train", "reproduce", "ablate", "evaluate", "export", "bench"})
"""Commands that don't end soon, or need what those leave."""

HOSTS = ("127.0.0.1", "robot.local")
"""The only hosts that pages may name."""


def page_id(page: Path) -> str:
    return str(page.relative_to(ROOT))


def with_blocks(*languages: str) -> list[Any]:
    return [
        pytest.param(page, id=page_id(page))
        for page in PAGES
        if any(block.language in languages for block in blocks(page))
    ]


# --- code -------------------------------------------------------------------------------------------------------------


@cache
def short_sample(frames: int = 120) -> str:
    """The beginning of the recording that comes with fervor."""
    head, motion = re.split(r"Frames: \d+\n", SAMPLE.read_text(encoding="utf-8"))
    return f"{head}Frames: {frames}\n" + "".join(motion.splitlines(keepends=True)[: 1 + frames])


@pytest.fixture(autouse=True)
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder to work in, with the reader's recordings."""
    for name in RECORDINGS:
        (tmp_path / name).write_text(short_sample(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("page", with_blocks("python", "sh"))
def test_code_runs(page: Path, live: Live) -> None:
    namespace: dict[str, Any] = {"__name__": "docs"}
    said = ""
    for block in blocks(page):
        where = f"{page}, line {block.line}"
        match block.language:
            case "python":
                text = "\n" * (block.line - 1) + block.text.replace(SERVICE, live.address)
                with redirect_stdout(io.StringIO()) as out:
                    exec(compile(text, str(page), "exec"), namespace)
                said = out.getvalue()
            case "sh":
                for command in commands(block):
                    run_command(words(command.replace(SERVICE, live.address)), live, f"{where}: {command}")
            case "text" if block.follows:
                assert said == block.text, where


def run_command(command: list[str], live: Live, where: str) -> None:
    program, *arguments = command
    match program:
        case "fervor":
            run_or_parse(arguments, live, where)
        case "fervor-pepper":
            run_pepper(arguments)
        case "curl":
            run_curl(arguments, where)
        case "docker":  # too slow to run here: the file it reads must know what is asked of it
            assert arguments[0] == "compose", where
            compose = (ROOT / "compose.yaml").read_text(encoding="utf-8")
            profiles = [name for option, name in pairwise(arguments) if option == "--profile"]
            assert all(f"profiles: [{name}]" in compose for name in profiles), where
            assert all((ROOT / name).exists() for option, name in pairwise(arguments) if option == "-f"), where
        case variable if "=" in variable:
            run_command(arguments, live, where)
        case "kubectl" | "k6" | "openssl" | ".venv-face/bin/python":  # what they act on must be there
            for named in (word for word in arguments if word.startswith(("deploy/", "examples/"))):
                assert (ROOT / named).parent.exists(), where
                assert (ROOT / named).exists() or program == "openssl", where
        case "make":
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            assert re.search(rf"^{arguments[0]}:", makefile, re.MULTILINE), where
        case "." | "npm" | "install":  # npm's are run by test_js_docs.py
            known = (".venv/bin/activate", "install/setup.sh", "install ./clients/js", "-d -m 700 secrets")
            assert " ".join(arguments) in known, where
        case _:
            check_ros(command, where)


def commands(block: Block) -> Iterator[str]:
    lines = block.text.replace("\\\n", " ").splitlines()
    yield from (line for line in lines if line.strip() and not line.startswith("#"))


def words(command: str) -> list[str]:
    """A command as typed, without comments and settings of the environment before it."""
    parts = shlex.split(command, comments=True)
    while "=" in parts[0] and parts[0].split("=")[0].isupper():
        parts = parts[1:]
    return parts


def run_or_parse(arguments: list[str], live: Live, where: str) -> None:
    name, rest = arguments[0], arguments[1:]
    endless = name in LONG or any(word.startswith("runs/") for word in rest)
    if endless or (name == "stream" and "--fast" not in rest):
        parse(arguments)
        return
    if name == "stream" and "--url" not in rest:
        arguments = [*arguments, "--url", live.stream]  # it would look for a service at `SERVICE`
    with redirect_stdout(io.StringIO()):
        assert run_fervor(arguments) == 0, where


def parse(arguments: list[str]) -> None:
    """Have the program read its arguments as it would; raises what it would complain of."""
    group = typer.main.get_command(build_app(arguments))
    assert isinstance(group, typer.core.TyperGroup)
    with group.make_context("fervor", list(arguments)) as context:
        name, command, rest = group.resolve_command(context, [*context._protected_args, *context.args])
        assert command is not None
        command.make_context(name, rest, parent=context)


def run_pepper(arguments: list[str]) -> None:
    """Dry runs for real; what needs a robot is only parsed. `> FILE` is where the output goes."""
    arguments, target = (arguments[:-2], arguments[-1]) if ">" in arguments else (arguments, None)
    command = typer.main.get_command(pepper)
    if target is None and "--dry-run" not in arguments:
        command.make_context("fervor-pepper", list(arguments))
        return
    with redirect_stdout(io.StringIO()) as out:
        command.main(list(arguments), prog_name="fervor-pepper", standalone_mode=False)
    if target is not None:
        Path(target).write_text(out.getvalue(), encoding="utf-8")


def run_curl(arguments: list[str], where: str) -> None:
    if shutil.which("curl") is None and not os.environ.get("CI"):
        return
    command = ["curl", "--fail-with-body", *arguments]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, f"{where}: {done.stdout}{done.stderr}"


@pytest.mark.parametrize("page", with_blocks("json"))
def test_json_is_protocol(page: Path) -> None:
    message: TypeAdapter[Any] = TypeAdapter(ClientMessage | ServerMessage)
    for block in blocks(page):
        for line in block.text.splitlines() if block.language == "json" else ():
            message.validate_json(line, strict=True)


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_block_says_what_becomes_of_it(page: Path) -> None:
    fences = re.findall(r"^```(.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(fences[::2]) <= {"python", "sh", "json", "text", "js"}  # js: test_js_docs.py
    assert set(fences[1::2]) <= {""}


def test_extras_are_those_of_the_project() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for page in PAGES:
        for extra in re.findall(r"pip install [^`\n]*\[(\w+)\]", page.read_text(encoding="utf-8")):
            assert extra in extras, page


# --- links ------------------------------------------------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    """What GitHub makes of headings."""
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in headings(page)}


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=page_id)
def test_links_lead_somewhere(page: Path) -> None:
    content = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", content):
        path, _, anchor = target.partition("#")
        found = (page.parent / path).resolve() if path else page
        assert found.exists(), f"{page}: {target}"
        assert not anchor or anchor in anchors(found), f"{page}: {target}"
    for host in re.findall(r"\w+://([\w.-]+)", content):
        assert host in HOSTS, f"{page} names {host}"


def test_all_pages_are_in_the_index() -> None:
    listed = {(DOCS / target).resolve() for target in re.findall(r"\]\(([^)#]+)", read("README.md"))}
    assert {page for page in PAGES if page.parent not in (ROOT, DOCS)} <= listed


def test_pages_that_the_code_speaks_of_exist() -> None:
    titles = {head for page in PAGES for head in headings(page)}
    for source in (path for top in ("service", "export", "clients", "examples") for path in (ROOT / top).rglob("*.py")):
        text = source.read_text(encoding="utf-8")
        for title in re.findall(r'docs, "([^"]+)"', text):
            assert title in titles, f"{source} speaks of the page {title!r}"
        for path in re.findall(r"docs/[\w/-]+\.md", text):
            assert (ROOT / path).exists(), f"{source} speaks of {path}"
