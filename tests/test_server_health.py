"""Health that can fail: alive is one thing, ready another."""

import asyncio

import httpx
import numpy as np
import pytest

from bodies import motion
from fervor.errors import EngineError
from fervor.model import Outputs
from live import Live, frames_of, talk


class BrokenModel:
    """A model whose runs fail, in one way or another."""

    def __init__(self, model, failure) -> None:
        self.metadata = model.metadata
        self._model, self._failure = model, failure

    def run(self, *arguments) -> Outputs:
        return self._failure(self._model.run(*arguments))


def raises(_: Outputs) -> Outputs:
    raise EngineError("model fervor-demo failed to run: out of memory")


def raises_anything(_: Outputs) -> Outputs:
    raise ZeroDivisionError


def gives_nan(outputs: Outputs) -> Outputs:
    return Outputs(outputs.intensity * np.float32(np.nan), outputs.intensity_by_emotion, outputs.states)


def test_a_good_service_is_alive_and_ready(http: httpx.Client) -> None:
    assert http.get("/healthz").json() == {"status": "alive"}
    assert http.get("/readyz").json() == {"status": "ready"}


@pytest.mark.parametrize(
    ("failure", "sentence"),
    [
        (raises, "model fervor-demo failed to run: out of memory"),
        (raises_anything, "the model could not be run on this frame"),
        (gives_nan, "not finite"),
    ],
)
def test_a_model_that_fails_is_not_ready_but_alive(failure, sentence: str, start_service) -> None:
    service = start_service()
    engine = service.service.batcher.engine
    good = engine.model
    engine.model = BrokenModel(good, failure)
    answer = httpx.get(f"{service.url}/readyz")
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert sentence in answer.json()["detail"]
    assert httpx.get(f"{service.url}/healthz").status_code == 200
    engine.model = good
    assert httpx.get(f"{service.url}/readyz").status_code == 200


async def test_a_batcher_that_is_stuck_is_not_ready(start_service, monkeypatch: pytest.MonkeyPatch) -> None:
    service = start_service()
    monkeypatch.setattr("fervor.server.probe.PATIENCE_S", 0.05)
    monkeypatch.setattr(service.service.batcher, "_scheduled", True)  # nothing will be scheduled any more
    answer = await asyncio.to_thread(httpx.get, f"{service.url}/readyz")
    assert answer.status_code == 503
    assert "took longer than 0.05 s" in answer.json()["detail"]


async def test_a_full_service_is_ready_all_the_same(start_service) -> None:
    service = start_service(capacity=1)
    async with talk(service) as stream:
        await stream.start()
        await stream.follow(frames_of(motion(2)))
        answer = await asyncio.to_thread(httpx.get, f"{service.url}/readyz")
        assert answer.status_code == 200


async def test_probes_change_no_bit_of_a_session(live: Live) -> None:
    frames = frames_of(motion(40))
    async with talk(live) as stream:
        await stream.start()
        expected = await stream.follow(frames)
    async with talk(live) as stream, httpx.AsyncClient(base_url=live.url) as client:
        await stream.start()
        first = await stream.follow(frames[:20])
        await asyncio.gather(*(client.get("/readyz") for _ in range(10)))
        assert first + await stream.follow(frames[20:]) == expected
