"""A real browser for tests of the live page: Debian's Chromium, driven by Playwright, drawing in software."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from fervor.server.page import built_page
from waiting import until

FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)

DESKTOP = {"width": 1280, "height": 900}
PHONE = {"width": 390, "height": 844}

PATIENCE_MS = 60_000
"""Drawing in software on a busy machine takes its time."""


def need_page() -> None:
    """The built page and a browser; a test without them is skipped, except in CI."""
    for there, what in (
        ((built_page() / "index.html").is_file(), "the live page is not built"),
        (chromium(), "no Chromium is here"),
    ):
        if not there:
            if os.environ.get("CI"):
                pytest.fail(what)
            pytest.skip(what)


def chromium() -> str | None:
    """The browser's program."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


def fake_camera(film: Path) -> tuple[str, ...]:
    """Flags that make a film (*.y4m) the webcam, which nobody is asked for."""
    return (
        "--use-fake-device-for-media-stream",
        "--use-fake-ui-for-media-stream",
        f"--use-file-for-fake-video-capture={film}",
    )


@contextmanager
def browsing(*flags: str) -> Iterator[Browser]:
    """A browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=[*FLAGS, *flags])
        try:
            yield browser
        finally:
            browser.close()


class Visit:
    """A page that somebody looks at, with all that it complained of and asked for."""

    def __init__(self, browser: Browser, url: str, **options) -> None:
        self.context = browser.new_context(**{"viewport": DESKTOP, **options})
        self.context.set_default_timeout(PATIENCE_MS)
        self.url = url
        self.complaints: list[str] = []
        self.asked: set[str] = set()
        self.page: Page = self.context.new_page()
        self.page.on("console", lambda said: said.type == "error" and self.complaints.append(said.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.asked.add(request.url))
        self.page.on("websocket", lambda socket: self.asked.add(socket.url))
        self.page.goto(url)

    def wait_live(self) -> None:
        self.page.locator("#link[data-state=live]").wait_for()
        self.page.locator("#stream").wait_for()
        self.page.locator("#emotion option").nth(1).wait_for(state="attached")

    def card(self, body: str):
        """The card of a body."""
        return self.page.get_by_role("article", name=body, exact=True)

    def until(self, condition: str, argument: object = None) -> object:
        """Wait until a JavaScript function of the page gives something true.

        Asked again and again from here: what Playwright leaves in the page to ask there may not, by the page's policy.
        """
        return until(lambda: self.page.evaluate(condition, argument))
