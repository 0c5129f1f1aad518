"""`GET /`: the live page, made of static files that `make page` builds into the package.

Rules. The page loads nothing from elsewhere, and its headers hold it to that. It carries no secret and no data, so it
needs no token itself; what it shows comes over `/v1/watch`, which does.
"""

from importlib.resources import files
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

FOLDER = "/page"
"""Where the page's files are."""

DETECTOR = "pose.html"
"""The document in which the pose detector runs: a frame of the page's."""

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

_DETECTOR_POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; img-src blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
"""The detector is WebAssembly, which the page itself need not be able to run."""

_HEADERS = {
    "Cache-Control": "no-cache",  # asked for each time, and answered with 304 where nothing changed
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(self), microphone=(), geolocation=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>fervor</title>
<h1>fervor runs</h1>
<p>Its live page is not built. In a checkout, <code>make page</code> builds it; then reload this page.
<p>Robots need no page: they stream to <code>/v1/stream</code>. <a href="docs">What else there is</a>.
</html>
"""


class PageFiles(StaticFiles):
    """Static files with the headers that bind the page."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """A file."""
        response = await super().get_response(path, scope)
        return _bound(response, detector=path == DETECTOR)


def built_page() -> Path:
    """The folder of the built page; it need not be there."""
    return Path(str(files("fervor.server").joinpath("page_files")))


def serve_page(app: FastAPI, folder: Path | None = None) -> None:
    """Add the page to an application; where it was not built, one that says so.

    Args:
        app: to add to.
        folder: of the built page; by default that of the package.
    """
    static = PageFiles(directory=folder or built_page(), check_dir=False)

    async def page(request: Request) -> Response:
        if not (Path(str(static.directory)) / "index.html").is_file():
            return _bound(HTMLResponse(NOT_BUILT))
        return await static.get_response("index.html", request.scope)

    app.add_route("/", page, methods=["GET"], include_in_schema=False)
    app.mount(FOLDER, static)


def _bound(response: Response, *, detector: bool = False) -> Response:
    response.headers.update(_HEADERS)
    response.headers["Content-Security-Policy"] = _DETECTOR_POLICY if detector else _POLICY
    return response
