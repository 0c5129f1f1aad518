"""Calibrations kept on the service can be named like the catalogue's skeletons, in streams and in scores."""

from pathlib import Path

import httpx
import pytest

from bodies import motion
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.server.kept_skeletons import load_skeletons
from fervor.settings import SettingsError
from fervor.skeletons.catalog import SKELETONS
from live import Live, bare, frames_of, score, score_request, talk

CMU = SKELETONS["cmu"]
FRAMES = frames_of(motion(40, joints=len(CMU.joints)))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    kept = SkeletonSpec.of(CMU, name="mine")
    (tmp_path / "mine.json").write_text(kept.model_dump_json(), encoding="utf-8")
    (tmp_path / "notes.txt").write_text("not a skeleton", encoding="utf-8")
    return tmp_path


@pytest.fixture
def service(start_service, folder: Path) -> Live:
    return start_service(skeletons=folder)


def test_it_is_in_the_catalogue(service: Live) -> None:
    names = [known["name"] for known in httpx.get(f"{service.url}/v1/skeletons").json()]
    assert {"c13", "cmu", "mine"} <= set(names)


async def test_streams_and_scores_take_it(service: Live) -> None:
    streamed = {}
    for name in ("cmu", "mine"):
        async with talk(service) as stream:
            await stream.start(skeleton=name, emotion="joy")
            streamed[name] = await stream.follow(FRAMES)
    assert streamed["mine"] == streamed["cmu"]
    (scored,) = await score(service, score_request(FRAMES, skeleton="mine", emotion="joy"))
    assert bare(scored["estimates"]) == bare(streamed["mine"])


def test_none_are_kept_by_default() -> None:
    assert load_skeletons(None) == {}


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="is not a folder"):
        load_skeletons(tmp_path / "nothing")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"name": "x", "joints": ["a"], "parents": [0], "segments": {}}'])
def test_a_file_that_is_no_skeleton(content: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(SettingsError) as raised:
        load_skeletons(tmp_path)
    assert str(path) in raised.value.message
    assert "\n" not in raised.value.message
