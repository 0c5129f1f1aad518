"""The golden transcripts, all of them: the JavaScript client plays its half of them against a real service."""

import threading
from contextlib import ExitStack
from pathlib import Path

import pytest

from js import built, desk, script  # noqa: F401  # fixtures
from live import running
from transcripts import FOLDER, load

pytestmark = pytest.mark.timeout(300)  # the first one builds, packs and installs the client

PATHS = sorted(FOLDER.glob("*.jsonl"))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_it_is_played_to_its_end(desk: Path, path: Path) -> None:  # noqa: F811
    lines = load(path)
    settings = lines[0]["settings"]
    acts = [line["service"] for line in lines if "service" in line]
    with ExitStack() as services:
        live = services.enter_context(running(**settings))
        with script(desk, "player.js", path, live.stream) as player:
            stopping: threading.Thread | None = None
            for act in acts:
                assert player.hear(has="service")["service"] == act
                if act == "stops":
                    stopping = threading.Thread(target=live.stop)
                    stopping.start()
                    continue
                if stopping is not None:
                    stopping.join()
                live = services.enter_context(running(**settings))
                player.tell(live.stream)
            assert player.hear(has="played")["played"] == len(lines)
