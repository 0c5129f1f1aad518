"""What operators watch moves when the service works."""

import httpx
import pytest
import websockets
from prometheus_client.parser import text_string_to_metric_families

from bodies import motion
from live import Live, eventually, frames_of, talk


def scraped(service: Live) -> dict[str, float]:
    text = httpx.get(f"{service.url}/metrics", timeout=30).text
    return {
        sample.name + "".join(f":{value}" for value in sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


async def test_frames_sessions_and_runs_are_counted_live_and_afterwards(start_service) -> None:
    service = start_service()
    before = scraped(service)
    async with talk(service) as conversation:
        await conversation.start()
        await conversation.follow(frames_of(motion(40)))
        during = scraped(service)
        assert (during["fervor_sessions"], during["fervor_bodies"]) == (1, before["fervor_bodies"] + 1)
        assert (during["fervor_frames_total"], during["fervor_estimates_total"]) == (40, 40)
        assert during["fervor_batch_size_sum"] - before["fervor_batch_size_sum"] >= 40
        assert during["fervor_run_seconds_count"] > before["fervor_run_seconds_count"]
    await eventually(lambda: scraped(service)["fervor_sessions"] == 0)
    after = scraped(service)
    assert (after["fervor_frames_total"], after["fervor_sessions_total"]) == (40, 1)
    assert after["fervor_bodies"] == before["fervor_bodies"]


async def test_refusals_say_why(start_service) -> None:
    service = start_service(max_sessions=1)
    async with talk(service):
        with pytest.raises(websockets.InvalidStatus):
            async with talk(service):
                pass
    assert scraped(service)["fervor_sessions_refused_total:sessions"] == 1


async def test_the_loop_is_watched(start_service) -> None:
    service = start_service()
    await eventually(lambda: scraped(service)["fervor_loop_lag_seconds_count"] > 0)
