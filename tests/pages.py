"""The pages of the documentation, read by tests: their blocks of code, sections, headings and tables."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = (ROOT / "README.md", *sorted(DOCS.rglob("*.md")))


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    text: str
    line: int
    """Of its first line in the page, from 1."""
    follows: bool
    """Whether it stands right below another block."""


def blocks(page: Path) -> list[Block]:
    content = page.read_text(encoding="utf-8")
    found, last = [], -1
    for match in re.finditer(r"^```(\w+)\n(.*?)^```\n", content, re.MULTILINE | re.DOTALL):
        between = content[last : match.start()] if last >= 0 else "far"
        found.append(Block(match[1], match[2], content.count("\n", 0, match.start(2)) + 1, not between.strip()))
        last = match.end()
    return found


def headings(page: Path) -> list[str]:
    content = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"^#+ (.+)$", content, re.MULTILINE)


def read(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def section(name: str, heading: str) -> str:
    """What stands between a heading and the next one of its level or above."""
    level = len(heading) - len(heading.lstrip("#"))
    match = re.search(rf"^{re.escape(heading)}\n(.*?)(?=^#{{1,{level}}} |\Z)", read(name), re.MULTILINE | re.DOTALL)
    assert match, f"docs/{name} has no heading {heading!r}"
    return match[1]


def table(text: str) -> list[list[str]]:
    """The cells of the first table in a text, without its head."""
    match = re.search(r"^\|.*\n\|[-:| ]+\|\n((?:\|.*\n)*)", text, re.MULTILINE)
    assert match, f"no table in: {text[:200]}"
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in match[1].splitlines()]


def names(rows: list[list[str]]) -> set[str]:
    return {row[0].strip("`") for row in rows}
