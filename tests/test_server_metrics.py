"""What operators watch moves when the service works."""

import json
import re
from pathlib import Path

import httpx
import pytest
import websockets
from prometheus_client.parser import text_string_to_metric_families

from bodies import motion
from live import Live, eventually, frames_of, score_request, talk


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


async def test_refused_tokens_and_origins_are_counted(start_service) -> None:
    service = start_service(tokens="alpha")
    for options in ({}, {"origin": "https://elsewhere.example"}):
        with pytest.raises(websockets.InvalidStatus):
            async with talk(service, **options):
                pass
    metrics = scraped(service)
    assert metrics["fervor_sessions_refused_total:unauthorized"] == 1
    assert metrics["fervor_sessions_refused_total:origin_refused"] == 1


async def test_ends_say_why(start_service) -> None:
    service = start_service(idle_timeout_s=0.5)
    async with talk(service) as silent:
        await silent.start()
        assert (await silent.closed())[0] == 4408
    async with talk(service) as polite:
        await polite.start()
        await polite.send("session.end")
        await polite.closed()
    async with talk(service) as rude:
        await rude.start()
        rude.socket.transport.abort()
    reasons = ("idle_timeout", "ended", "gone")
    await eventually(
        lambda: [scraped(service).get(f"fervor_sessions_ended_total:{reason}") for reason in reasons] == [1, 1, 1]
    )


async def test_checkpoints_gaps_bytes_and_resumed_bodies_are_counted(start_service) -> None:
    service = start_service()
    frames = frames_of(motion(40), rate_hz=30.0)
    frames[-1]["t"] += 0.5  # s: held over a gap
    async with talk(service) as first:
        await first.start(checkpoint_s=0.5)
        heard = []
        for number, frame in enumerate(frames, start=1):  # one by one: a checkpoint that waits gives way to a newer one
            await first.send("frame", **frame)
            while sum(message["type"] == "estimate" for message in heard) < number:
                heard.append(await first.hear())
        while len(heard) < len(frames) + 4:
            heard.append(await first.hear())
    tokens = [message["token"] for message in heard if message["type"] == "checkpoint"]
    async with talk(service) as second:
        started = await second.start(checkpoint_s=0.5, resume=[tokens[-1]])
        assert len(started["resumed"]) == 1
        metrics = scraped(service)
    assert metrics["fervor_checkpoints_total"] == len(tokens) == 4
    assert sum(map(len, tokens)) < metrics["fervor_checkpoint_bytes_total"] < sum(map(len, tokens)) + 4 * 200
    assert metrics["fervor_bodies_resumed_total"] == 1
    assert metrics["fervor_gaps_total"] == 1
    assert metrics["fervor_received_bytes_total"] > len(frames) * 500
    assert metrics["fervor_sent_bytes_total"] > metrics["fervor_checkpoint_bytes_total"]


async def test_checkpoints_that_a_calibration_brings_are_counted(start_service) -> None:
    service = start_service()
    async with talk(service) as session:
        joints = (await session.start(skeleton="kinect_v2", checkpoint_s=60.0))["joints"]
        await session.send("session.calibrate", seconds=0.2)
        for seq in range(2):
            await session.send("frame", seq=seq, t=seq / 4, q=[[0, 0, 0, 1]] * len(joints))
        *_, calibrated = [await session.hear() for _ in range(3)]
        metrics = scraped(service)
    (checkpoint,) = calibrated["checkpoints"]
    assert metrics["fervor_checkpoints_total"] == 1
    assert metrics["fervor_checkpoint_bytes_total"] == len(checkpoint["token"])


def test_scoring_is_watched(start_service) -> None:
    service = start_service()
    request = score_request(frames_of(motion(3)))
    assert httpx.post(f"{service.url}/v1/score", json=request, timeout=60).status_code == 200
    metrics = scraped(service)
    assert (metrics["fervor_score_seconds_count"], metrics["fervor_score_queue"]) == (1, 0)


def test_the_build_says_what_runs(live: Live) -> None:
    text = httpx.get(f"{live.url}/metrics", timeout=30).text
    (family,) = (found for found in text_string_to_metric_families(text) if found.name == "fervor_build_info")
    (sample,) = family.samples
    model = live.service.model
    assert sample.value == 1
    assert sample.labels["sha256"] == model.sha256
    assert sample.labels["purpose"] == model.metadata.purpose == "demo"


def test_nobody_is_named(live: Live) -> None:
    allowed = {"le", "reason", "version", "model", "model_version", "purpose", "sha256", "fingerprint"}
    families = text_string_to_metric_families(httpx.get(f"{live.url}/metrics", timeout=30).text)
    assert {name for family in families for sample in family.samples for name in sample.labels} <= allowed


DASHBOARD = Path(__file__).resolve().parents[1] / "deploy" / "grafana" / "dashboards" / "fervor.json"


def test_the_dashboard_asks_for_metrics_that_are_there_and_for_all_of_them(live: Live) -> None:
    text = httpx.get(f"{live.url}/metrics", timeout=30).text
    families = list(text_string_to_metric_families(text))
    known = {sample.name for family in families for sample in family.samples}
    known |= {f"{family.name}_total" for family in families if family.type == "counter"}  # also before they first count
    panels = json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]
    queries = [target["expr"] for panel in panels for target in panel["targets"]]
    asked = {name for query in queries for name in re.findall(r"\b(?:fervor|process)_\w+", query)}
    assert asked <= known
    shown = {re.sub(r"_(total|bucket|sum|count)$", "", name) for name in asked}
    ours = {family.name for family in families if family.name.startswith("fervor_")}
    assert {name for name in ours if not name.endswith("_created")} <= shown


def test_the_dashboard_has_no_panel_over_another() -> None:
    panels = json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]
    cells = [
        (column, row)
        for place in (panel["gridPos"] for panel in panels)
        for column in range(place["x"], place["x"] + place["w"])
        for row in range(place["y"], place["y"] + place["h"])
    ]
    assert len(cells) == len(set(cells))
    assert max(column for column, _ in cells) == 23
    assert len({panel["id"] for panel in panels}) == len(panels)


async def test_the_loop_is_watched(start_service) -> None:
    service = start_service()
    await eventually(lambda: scraped(service)["fervor_loop_lag_seconds_count"] > 0)
