"""The JavaScript client as a package: its own tests, its types, and what is in it."""

import json
from pathlib import Path

import pytest

from js import CLIENT, built, desk, run  # noqa: F401  # fixtures

pytestmark = pytest.mark.timeout(300)  # the first one builds, packs and installs the client


def test_its_own_tests_pass(built: Path) -> None:  # noqa: F811
    run("npm", "test", cwd=built, timeout=280)


def test_its_style_is_kept(built: Path) -> None:  # noqa: F811
    run("npm", "run", "lint", cwd=built)


def test_its_types_are_those_of_the_service(built: Path, tmp_path: Path) -> None:  # noqa: F811
    """As `npm run types` writes them."""
    (tmp_path / "messages.ts").write_text(run("node", "scripts/types.js", cwd=built))
    run("npx", "biome", "format", "--write", "--config-path", built, tmp_path / "messages.ts", cwd=built)
    kept = (built / "src" / "messages.ts").read_text()
    assert (tmp_path / "messages.ts").read_text() == kept, "run `npm run types` in clients/js"


def test_it_holds_what_users_need_and_nothing_else(desk: Path) -> None:  # noqa: F811
    installed = desk / "node_modules" / "fervor-client"
    package = json.loads((installed / "package.json").read_text())
    assert "dependencies" not in package
    assert package["license"] == "Apache-2.0"
    assert {path.name for path in installed.iterdir()} == {"LICENSE", "README.md", "dist", "package.json", "src"}
    sources = {path.stem for path in (CLIENT / "src").glob("*.ts")}
    dist = {path.name for path in (installed / "dist").iterdir()}
    assert dist == {f"{stem}{end}" for stem in sources for end in (".js", ".js.map", ".d.ts")}
    files = [path for path in installed.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 1_000_000


def test_users_of_typescript_get_types(built: Path, desk: Path) -> None:  # noqa: F811
    """In Node and in a bundler for browsers, where the same names stand."""
    (desk / "user.ts").write_text(
        'import { connect, type Estimate, FrameError, type Options } from "fervor-client";\n'
        'const options: Options = { emotion: "joy", by_emotion: true, retryForS: Infinity };\n'
        'const session = await connect("ws://127.0.0.1:8080", options);\n'
        "const pose = new Float32Array(4 * session.joints.length);\n"
        "const estimate: Estimate = await session.estimate(pose, { t: 0 });\n"
        "const intensity: number | null = estimate.intensity;\n"
        "export const told = [intensity, estimate.flags.length, FrameError.code];\n"
    )
    common = ("--noEmit", "--strict", "--exactOptionalPropertyTypes", "--skipLibCheck", "false", "--target", "es2023")
    tsc = built / "node_modules" / ".bin" / "tsc"
    types = ("--types", "node", "--typeRoots", built / "node_modules" / "@types")
    run(tsc, *common, *types, "--module", "nodenext", "user.ts", cwd=desk)
    lib = ("--lib", "es2023,esnext.disposable,dom", "--types", "")
    run(tsc, *common, *lib, "--module", "esnext", "--moduleResolution", "bundler", "user.ts", cwd=desk)
