"""The live page in a real browser: what it shows is what the service says, whoever looks and however."""

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import onnx
import pytest
from playwright.sync_api import Browser

import fervor_client
from bodies import motion
from browser import PHONE, Visit, browsing, need_page
from fervor.model import default_model_path
from fervor.recordings.reader import read_recording
from fervor.recordings.writer import write_recording
from fervor.server.watch_messages import MOST_SHOWN
from live import Live, running
from pages import ROOT
from program import write_bvh
from suits import Person, mvnx

AXE = ROOT / "page" / "node_modules" / "axe-core" / "axe.min.js"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    need_page()
    with browsing() as browser:
        yield browser


@pytest.fixture(scope="module")
def service(browser: Browser) -> Iterator[Live]:
    with running(max_bodies=64) as live:
        yield live


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Visit]]:
    """Opens the page of a service."""
    with ExitStack() as stack:

        def open_page(live: Live, *, wait: bool = True, **options) -> Visit:
            visit = Visit(browser, live.url, **options)
            stack.callback(visit.context.close)
            if wait:
                visit.wait_live()
            return visit

        yield open_page


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return write_bvh(tmp_path / "wave.bvh", seconds=4.0)


def robot(live: Live, **options) -> fervor_client.sync.Session:
    return fervor_client.sync.connect(live.stream, **options)


def drop(seen: Visit, *files: Path) -> None:
    """Drop files on the page, as a mouse would."""
    entries = [{"name": path.name, "text": path.read_text()} for path in files]
    seen.page.evaluate(
        """(entries) => {
            const dataTransfer = new DataTransfer();
            for (const { name, text } of entries) dataTransfer.items.add(new File([text], name));
            for (const kind of ["dragover", "drop"]) {
                const options = { bubbles: true, cancelable: true, dataTransfer };
                document.querySelector("main").dispatchEvent(new DragEvent(kind, options));
            }
        }""",
        entries,
    )


def picture(seen: Visit, body: str) -> str:
    """What a body's figure looks like."""
    return seen.card(body).locator("canvas.figure").evaluate("(canvas) => canvas.toDataURL()")


# --- what it shows ----------------------------------------------------------------------------------------------------


def test_a_robots_body_appears_by_itself_with_its_estimate(service: Live, visit) -> None:
    seen = visit(service)
    with robot(service, emotion="joy", skeleton="c13") as session:
        for at, pose in enumerate(motion(60)):
            estimate = session.estimate(pose, t=at / 30, body="anna")
        card = seen.card("anna")
        shown = f"{estimate.intensity:.2f}"
        card.locator(".intensity", has_text=shown).wait_for()
        assert card.locator(".level").inner_text() == estimate.level
        assert card.locator("dd").all_inner_texts()[0] == "joy"
        seen.page.get_by_text("1 body in 1 session").wait_for()
        seen.page.locator("summary", has_text="Sessions").click()
        assert seen.page.locator("#sessions td").all_inner_texts()[1:] == ["c13", "1", "60"]
    card.get_by_text("gone").wait_for()
    assert seen.complaints == []


def test_the_figure_moves_as_the_body_does(service: Live, visit) -> None:
    seen = visit(service)
    poses = motion(2, speed=0.8)
    with robot(service) as session:
        session.estimate(poses[0], t=0.0, body="anna")
        blank = "(canvas) => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some(Boolean)"
        seen.until(
            f"() => {{ const canvas = document.querySelector('canvas.figure'); return canvas && ({blank})(canvas) }}"
        )
        seen.page.wait_for_timeout(1000)  # the figure glides to its pose
        before = picture(seen, "anna")
        session.estimate(poses[1], t=0.1, body="anna")
        seen.until("(before) => document.querySelector('canvas.figure').toDataURL() !== before", before)


def test_other_emotions_are_shown_when_they_are_opened(service: Live, visit) -> None:
    seen = visit(service)
    with robot(service, emotion="joy", by_emotion=True) as session:
        for at, pose in enumerate(motion(40)):
            estimate = session.estimate(pose, t=at / 30, body="anna")
        card = seen.card("anna")
        assert card.get_by_role("meter").count() == 0
        card.locator("summary", has_text="Under every emotion").click()
        seen.until("() => document.querySelector('[role=meter]').ariaValueNow")
        told = {row.ariaLabel: row.value for row in map(_Meter, card.get_by_role("meter").all())}
    assert told == {emotion: f"{value:.2f}" for emotion, value in estimate.by_emotion.items()}


class _Meter:
    def __init__(self, locator) -> None:
        self.ariaLabel = locator.get_attribute("aria-label")
        self.value = locator.get_attribute("aria-valuenow")


def test_a_demo_model_is_called_one_and_another_is_not(service: Live, visit, tmp_path: Path) -> None:
    assert visit(service).page.get_by_text("Demo model.").is_visible()
    model = onnx.load(default_model_path())
    (entry,) = (prop for prop in model.metadata_props if prop.key == "fervor")
    entry.value = json.dumps({**json.loads(entry.value), "purpose": "research"})
    onnx.save(model, tmp_path / "research.onnx")
    with running(model=tmp_path / "research.onnx") as live:
        assert not visit(live).page.get_by_text("Demo model.").is_visible()


def test_many_bodies_are_leafed_through(service: Live, visit) -> None:
    seen = visit(service)
    with robot(service) as session:
        for body in range(MOST_SHOWN + 2):
            session.estimate(motion(1)[0], t=0.0, body=f"body {body:02}")
        seen.page.get_by_text(f"{MOST_SHOWN + 2} bodies in 1 session").wait_for()
        seen.until("(most) => document.querySelectorAll('article').length === most", MOST_SHOWN)
        seen.page.get_by_role("button", name="Later").click()
        seen.card(f"body {MOST_SHOWN}").wait_for()
        assert seen.page.get_by_role("article").count() == 2
        assert seen.page.get_by_role("button", name="Later").is_disabled()


# --- what it streams --------------------------------------------------------------------------------------------------


def test_a_dropped_file_is_streamed_and_scored_as_ever(service: Live, visit, wave: Path) -> None:
    seen = visit(service)
    with fervor_client.sync.connect(service.stream):
        drop(seen, wave)
        seen.card("wave.bvh").wait_for()
        assert seen.page.locator("#own li").inner_text().startswith("wave.bvh")
        seen.until("() => Number(document.querySelector('.intensity').textContent) > 0")
        assert seen.card("wave.bvh").locator("dd").first.inner_text() == "joy"
        seen.page.locator("#own li").wait_for(state="detached")
    totals = service.service.drain.all_totals()
    assert totals.rejected == totals.late == 0
    assert seen.complaints == []


def test_tables_are_streamed_too(service: Live, visit, wave: Path) -> None:
    table = wave.with_suffix(".csv")
    write_recording(read_recording(wave), table)
    seen = visit(service)
    seen.page.locator("summary", has_text="Options").click()
    seen.page.get_by_label("Repeat files").check()
    drop(seen, table)
    seen.card("wave.csv").wait_for()
    seen.page.get_by_role("button", name="Stop wave.csv").click()
    seen.page.locator("#own li").wait_for(state="detached")


def test_a_suit_file_is_streamed_too(service: Live, visit, tmp_path: Path) -> None:
    """MVN writes w first, in axes and at a rate of its own; the page shows what the service scores of the same file."""
    suit = tmp_path / "suit.mvnx"
    suit.write_text(mvnx(motion(480).astype(float), Person(heading=30.0, plain_axes=False)), encoding="utf-8")
    asked = {"filename": suit.name, "emotion": "joy", "detail": "frames"}
    answer = httpx.post(f"{service.url}/v1/score/file", params=asked, content=suit.read_bytes(), timeout=60)
    scored = {f"{frame['intensity']:.2f}" for frame in answer.json()["sequences"][0]["estimates"]}
    before = service.service.drain.all_totals()
    seen = visit(service)
    with fervor_client.sync.connect(service.stream):
        drop(seen, suit)
        card = seen.card("suit.mvnx")
        card.get_by_text("gone").wait_for()
        assert card.locator(".intensity").inner_text() in scored
        assert card.locator("dd").all_inner_texts()[0] == "joy"
        totals = service.service.drain.all_totals()
    assert totals.estimates - before.estimates == 480
    assert (totals.rejected, totals.late) == (before.rejected, before.late)
    assert seen.complaints == []


def test_a_file_that_is_none_is_told_in_the_services_words(service: Live, visit, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("dear diary")
    seen = visit(service)
    drop(seen, tmp_path / "notes.txt")
    notice = seen.page.get_by_role("alert").get_by_text("notes.txt: not a recording; expected BVH")
    notice.wait_for()
    seen.page.get_by_role("button", name="Close").click()
    notice.wait_for(state="detached")
    assert seen.page.locator("#own li").count() == 0


def test_where_there_is_no_camera_that_is_told(service: Live, visit) -> None:
    seen = visit(service)
    seen.page.get_by_role("button", name="Use the webcam").click()
    seen.page.get_by_role("alert").locator(".notice").wait_for()
    assert not seen.page.locator("#preview").is_visible()
    assert seen.page.get_by_role("button", name="Use the webcam").is_enabled()


# --- who may look -----------------------------------------------------------------------------------------------------


def test_a_token_lets_in_and_stays_in_this_tab(visit) -> None:
    with running(tokens="alpha") as live:
        seen = visit(live, wait=False)
        seen.page.get_by_text("This service needs a token.").wait_for()
        for wrong in ("beta", "no token at all"):
            seen.page.get_by_label("Token").fill(wrong)
            seen.page.keyboard.press("Enter")
            seen.page.get_by_text("no token: it has" if " " in wrong else "does not know this token").wait_for()
        seen.page.get_by_label("Token").fill("alpha")
        seen.page.keyboard.press("Enter")
        seen.wait_live()
        assert seen.page.evaluate("JSON.stringify(localStorage) + document.cookie") == "{}"
        seen.page.reload()
        seen.wait_live()
        assert "alpha" not in "".join(seen.asked)


def test_the_page_comes_back_with_the_service(visit) -> None:
    with running() as live:
        port = live.bound.getsockname()[1]
        seen = visit(live)
    seen.page.locator("#link[data-state=waiting]").wait_for()
    with running(port=port):
        seen.wait_live()


def test_nothing_is_asked_of_anybody_else(service: Live, visit, wave: Path) -> None:
    seen = visit(service)
    drop(seen, wave)
    seen.card("wave.bvh").wait_for()
    assert seen.asked
    hosts = {url.split("/")[2] for url in seen.asked if not url.startswith("blob:")}
    assert hosts == {service.address}


# --- for everybody ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [{"width": 1280, "height": 900}, PHONE], ids=["desktop", "phone"])
def test_axe_finds_nothing(scheme: str, size: dict, service: Live, visit) -> None:
    seen = visit(service, color_scheme=scheme, viewport=size)
    with robot(service, emotion="joy") as session:
        for at, pose in enumerate(motion(40)):
            session.estimate(pose, t=at / 30, body="anna")
        card = seen.card("anna")
        card.locator("summary").click()
        seen.until("() => document.querySelector('[role=meter]').ariaValueNow")
        seen.page.evaluate(AXE.read_text())
        found = seen.page.evaluate("axe.run()")
        wide = seen.page.evaluate("document.documentElement.scrollWidth")
    assert [(each["id"], [node["html"] for node in each["nodes"]]) for each in found["violations"]] == []
    assert wide <= size["width"], "nobody scrolls sideways"


def test_all_can_be_done_with_keys(service: Live, visit, wave: Path) -> None:
    seen = visit(service)
    with robot(service) as session:
        session.estimate(motion(1)[0], t=0.0, body="anna")
        seen.card("anna").wait_for()
        reached = []
        for _ in range(16):
            seen.page.keyboard.press("Tab")
            reached.append(
                seen.page.evaluate(
                    "() => { const at = document.activeElement; return at.id || at.ariaLabel || at.textContent }"
                )
            )
    assert {"file", "webcam", "emotion"} <= set(reached)
    assert {"Options", "Turn the figure of anna, degrees", "Under every emotion", "Sessions"} <= set(reached)


def test_screen_readers_hear_of_a_level(service: Live, visit) -> None:
    seen = visit(service)
    with robot(service, emotion="joy") as session:
        for at, pose in enumerate(motion(40)):
            estimate = session.estimate(pose, t=at / 30, body="anna")
        seen.page.get_by_role("status").filter(has_text=f"anna: joy, {estimate.level}").wait_for(state="attached")
