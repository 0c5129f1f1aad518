"""The webcam: a film of a person as camera, the detector in the browser, points to the service, nothing elsewhere.

The film shows the portrait of Grace Hopper that comes with matplotlib, swaying a little.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib import cbook
from PIL import Image
from playwright.sync_api import Browser

from browser import Visit, browsing, fake_camera, need_page
from fervor.skeletons.rig import JOINTS
from live import Live, running
from waiting import until

SIZE = (640, 480)
SEEN = ("spine", "chest", "head")
"""What a portrait shows of the rig."""


def write_film(path: Path) -> Path:
    """A raw film (y4m) of some seconds, which Chromium plays over and over."""
    person = Image.open(cbook.get_sample_data("grace_hopper.jpg", asfileobj=False)).convert("RGB")
    person = person.resize((person.width * SIZE[1] // person.height, SIZE[1]))
    with path.open("wb") as film:
        film.write(b"YUV4MPEG2 W%d H%d F15:1 Ip A1:1 C420jpeg\n" % SIZE)
        for frame in range(40):
            picture = Image.new("RGB", SIZE, "grey")
            picture.paste(person, ((SIZE[0] - person.width) // 2 + round(20 * np.sin(frame / 6)), 0))
            light, *colours = picture.convert("YCbCr").split()
            film.write(b"FRAME\n" + light.tobytes())
            for colour in colours:
                film.write(colour.resize((SIZE[0] // 2, SIZE[1] // 2)).tobytes())
    return path


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    need_page()
    with browsing(*fake_camera(write_film(tmp_path / "person.y4m"))) as browser:
        yield browser


@pytest.fixture
def service(browser: Browser) -> Iterator[Live]:
    with running() as live:
        yield live


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_person_before_the_camera_becomes_a_body(browser: Browser, service: Live) -> None:
    seen = Visit(browser, service.url)
    seen.context.set_default_timeout(240_000)  # the detector starts in software, too
    seen.wait_live()
    seen.page.get_by_role("button", name="Use the webcam").click()
    seen.card("webcam").wait_for()
    totals = service.service.drain.all_totals
    until(lambda: totals().estimates >= 3, 120)
    seen.until("() => /^[3-9]|\\d\\d/.test(document.querySelector('#camera-text').textContent)")
    (session,) = (conversation.session for conversation in service.service.drain.talking)
    (body,) = session.bodies
    slots = service.service.batcher.engine.slots
    observed = dict(zip(JOINTS, slots.observed[body.slot].tolist(), strict=True))
    assert session.source is not None
    assert session.source.skeleton.name == "mediapipe"
    assert [joint for joint in SEEN if not observed[joint]] == []
    assert not observed["l_knee"], "a portrait shows no knees"
    turned = 2 * np.degrees(np.arccos(np.clip(np.abs(slots.pose[body.slot][[JOINTS.index("spine"), 1], 3]), 0, 1)))
    assert turned.max() < 45, "she sits upright, and is not upside down"
    assert seen.card("webcam").locator("dd").first.inner_text() == "joy"
    assert totals().rejected == 0

    seen.page.get_by_role("button", name="Stop the webcam").click()
    until(lambda: not service.service.drain.talking)
    assert seen.page.locator("iframe").count() == 0
    assert seen.page.locator("video").evaluate("(video) => video.srcObject") is None
    assert {url.split("/")[2] for url in seen.asked if not url.startswith("blob:")} == {service.address}
    assert not [text for text in seen.complaints if "Content Security Policy" in text]
    seen.context.close()
