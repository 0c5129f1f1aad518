"""The JavaScript in the documentation runs: in Node, and in a browser; and the options it lists are those there are."""

import re
from pathlib import Path

import pytest

from fervor.protocol.messages import SessionStart
from js import CLIENT, ROOT, built, chromium, run  # noqa: F401  # fixtures
from live import Live
from pages import DOCS, blocks, section, table
from sites import browsing, site

pytestmark = pytest.mark.timeout(300)  # the first one builds, packs and installs the client

SERVICE = "127.0.0.1:8080"
README = CLIENT / "README.md"
PAGE = DOCS / "how-to" / "javascript.md"
TELL = """
<script type="module">
  const told = () => document.querySelector("output").textContent;
  while (!told()) await new Promise((resolve) => setTimeout(resolve, 20));
  await fetch("/result", { method: "POST", body: JSON.stringify(told()) });
</script>
"""


@pytest.fixture(scope="module")
def project(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:  # noqa: F811
    """A user's project with the client in it, as the pages say."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "package.json").write_text('{"type": "module", "private": true}')
    for page in (README, PAGE):
        assert [block.text for block in blocks(page) if block.language == "sh"] == [
            "make js\nnpm install ./clients/js\n"
        ]
    run("npm", "install", "--offline", "--no-audit", "--no-fund", "--install-links=false", built, cwd=folder)
    return folder


@pytest.mark.parametrize("page", [README, PAGE], ids=lambda page: str(page.relative_to(ROOT)))
def test_the_javascript_of_a_page_runs_in_node(project: Path, live: Live, page: Path) -> None:
    """The blocks of a page in order, as one program."""
    program = "\n".join(block.text for block in blocks(page) if block.language == "js")
    (project / "page.js").write_text(program.replace(SERVICE, live.address))
    said = run("node", "--unhandled-rejections=strict", "page.js", cwd=project)
    if page == PAGE:
        assert re.search(r"^0: 0\.\d\d, (weak|strong)\n.*^90\njoy\nbad_frame 0\n\Z", said, re.MULTILINE | re.DOTALL), (
            said
        )
    else:
        assert re.fullmatch(r"(0\.\d\d (weak|strong)\n){30}", said), said


def test_the_page_of_the_readme_shows_an_intensity(
    project: Path,
    chromium: str,  # noqa: F811
    tmp_path: Path,
    start_service,
) -> None:
    html = next(block.text for block in blocks(README) if block.language == "html")
    with site(project) as (origin, page):
        service = start_service(origins=origin)
        (project / "page.html").write_text(html.replace(SERVICE, service.address) + TELL)
        with browsing(chromium, tmp_path / "profile", f"{origin}/page.html"):
            assert re.fullmatch(r"\d+ %", page.results.get(timeout=60))


def test_the_options_are_those_of_the_client() -> None:
    text = section("how-to/javascript.md", "## Options")
    source = (CLIENT / "src" / "options.ts").read_text()
    declared = re.findall(
        r"^  (\w+)\?:", source.partition("interface ClientOptions")[2].partition("\n}")[0], re.MULTILINE
    )
    assert [row[0].strip("`") for row in table(text)] == [*declared, "tls"]
    fields = re.findall(r"`(\w+)`", text.partition("by their names there:")[2])
    assert set(fields) == SessionStart.model_fields.keys() - {"type", "resume"}


def test_links_of_the_readme_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)\s#]+)\)", README.read_text()):
        assert (CLIENT / target).exists(), target
