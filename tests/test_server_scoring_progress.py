"""Progress as lines of JSON: asked for by Accept, told on the way, and ending in the scores or in a problem."""

import asyncio
import json

import httpx
import pytest

from bodies import motion
from fervor.errors import EngineError
from fervor.server.scoring_progress import NDJSON, Meter, Progress, Told, lines_of, wants_lines
from live import Live, frames_of, score_request
from waiting import until

LONG = score_request(frames_of(motion(2000)), name="walk", emotion="joy", detail="summary")
ACCEPT = {"Accept": NDJSON}


@pytest.mark.parametrize(
    ("accept", "wanted"),
    [
        ("", False),
        ("*/*", False),
        ("application/json", False),
        (NDJSON, True),
        ("application/json, Application/X-NDJSON;q=0.9", True),
    ],
)
def test_lines_are_for_who_asks(accept: str, wanted: bool) -> None:
    assert wants_lines(accept) is wanted


def test_a_meter_tells_at_once_and_not_too_often() -> None:
    told: list[Progress] = []
    meter = Meter(1000, told.append)
    assert told == [Progress(0, 1000)]
    for _ in range(1000):
        meter.add(1)
    assert len(told) < 900
    assert told == sorted(told, key=lambda progress: progress.frames)
    Meter(5, None).add(5)


def test_progress_leads_up_to_the_scores(http: httpx.Client) -> None:
    answer = http.post("/v1/score", json=LONG, headers=ACCEPT)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == NDJSON
    *progress, last = map(json.loads, answer.text.splitlines())
    assert progress[0] == {"type": "progress", "frames": 0, "of": 2000}
    assert {line["type"] for line in progress} == {"progress"}
    assert [line["frames"] for line in progress] == sorted(line["frames"] for line in progress)
    assert last == {"type": "scores", "scores": http.post("/v1/score", json=LONG).json()}


def test_files_are_told_of_too(http: httpx.Client, shared_data) -> None:
    path = shared_data / "cmu" / "79_69.bvh"
    asked = {"params": {"filename": path.name}, "content": path.read_bytes()}
    *progress, last = http.post("/v1/score/file", headers=ACCEPT, **asked).text.splitlines()
    scores = http.post("/v1/score/file", **asked).json()
    assert json.loads(progress[0])["of"] == scores["sequences"][0]["frames"]
    assert json.loads(last)["scores"] == scores


def test_what_is_wrong_from_the_start_is_a_problem(http: httpx.Client) -> None:
    answer = http.post("/v1/score", json={**LONG, "speed": 2}, headers=ACCEPT)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"


class FailingLate:
    """Stands for a scoring process that ends on its way."""

    async def run(self, *job: object, told: Told) -> bytes:
        told(Progress(0, 9))
        await asyncio.sleep(0)
        raise EngineError("the scoring process ended on this request; the fault is the service's own")


async def test_what_fails_on_its_way_ends_in_a_problem() -> None:
    first, last = [json.loads(line) async for line in lines_of(FailingLate(), "score")]
    assert first == {"type": "progress", "frames": 0, "of": 9}
    assert last["type"] == "problem"
    assert (last["problem"]["status"], last["problem"]["code"]) == (500, EngineError.code)
    assert last["problem"]["detail"].startswith("the scoring process ended")


async def test_who_goes_away_gives_the_request_up(start_service) -> None:
    service: Live = start_service()
    scoring = service.service.scoring
    async with httpx.AsyncClient(base_url=service.url, timeout=60) as client:
        async with client.stream("POST", "/v1/score", json={**LONG, "memory": "window"}, headers=ACCEPT) as answer:
            await anext(answer.aiter_lines())
        await asyncio.to_thread(until, lambda: not scoring.waiting)
        assert (await client.post("/v1/score", json=LONG)).status_code == 200
