"""Labels, bodies and deliveries through a real service: whatever the order of messages, each body gets its own."""

import asyncio
import json
from collections import defaultdict
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bodies import motion
from live import Live, Talk, frames_of, talk

proof = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
FRAMES = frames_of(motion(120), rate_hz=30)


async def converse(live: Live, messages: list[dict[str, Any]], **start: Any) -> list[dict[str, Any]]:
    """All that the service answers to `session.start`, these messages and `session.end`."""
    async with talk(live) as stream:
        await stream.start(**start)
        heard = asyncio.create_task(_to_the_end(stream))
        for message in [*messages, {"type": "session.end"}]:
            await stream.socket.send(json.dumps(message))
        return await heard


async def _to_the_end(stream: Talk) -> list[dict[str, Any]]:
    heard = [await stream.hear()]
    while heard[-1]["type"] != "session.ended":
        heard.append(await stream.hear())
    return heard


def estimates(heard: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The estimates among them, those of `frames` one by one."""
    return [
        {"type": "estimate", **estimate}
        for message in heard
        for estimate in (message.get("estimates") or ([message] if message["type"] == "estimate" else []))
    ]


# --- emotions ---------------------------------------------------------------------------------------------------------

ANALYSED = {"fear": 0.6, "surprise": 0.3}
labels = st.sampled_from([None] * 30 + ["joy", "anger", "unknown", ANALYSED])


def in_force(given_labels: list[Any], first: Any, ttl: float | None) -> list[str]:
    """What the label of each frame should be, worked out from the rules in the docs."""
    name, until, told = "unknown", None, []
    for number, label in enumerate([given_labels[0] or first, *given_labels[1:]]):
        time = number / 30
        if label is not None:
            name = "fear" if label == ANALYSED else label
            lasts = ttl if ttl is not None else 2.0 if label == ANALYSED else None
            until = None if lasts is None else time + lasts
        told.append(name if until is None or time <= until else "unknown")
    return told


@proof
@given(
    st.lists(labels, min_size=90, max_size=120),
    st.sampled_from([None, "joy", ANALYSED]),
    st.sampled_from([None, 0.51, 1.99]),
)
def test_a_label_a_probability_or_none_holds_as_long_as_it_should(
    live: Live, given_labels: list[Any], first: Any, ttl: float | None
) -> None:
    frames = [
        {"type": "frame", **frame, **({} if label is None else {"emotion": label})}
        for frame, label in zip(FRAMES, given_labels, strict=False)
    ]
    start = {key: value for key, value in (("emotion", first), ("emotion_ttl_s", ttl)) if value is not None}
    told = estimates(asyncio.run(converse(live, frames, by_emotion=True, **start)))
    assert [estimate["emotion"] for estimate in told] == in_force(given_labels, first, ttl)
    plain = estimates(asyncio.run(converse(live, [{"type": "frame", **frame} for frame in FRAMES], by_emotion=True)))
    for estimate, unlabelled in zip(told, plain, strict=False):
        assert estimate["by_emotion"] == unlabelled["by_emotion"], "no label touches the state"
        label = estimate["emotion"]
        if label == "unknown":
            assert estimate["intensity"] == unlabelled["intensity"]
        elif label in ("joy", "anger"):
            assert abs(estimate["intensity"] - estimate["by_emotion"][label]) < 1e-6


# --- bodies that come and go ------------------------------------------------------------------------------------------

goings = st.lists(st.tuples(st.sampled_from("abcd"), st.sampled_from(["frame"] * 12 + ["body.reset", "body.end"])))


def script(going: list[tuple[str, str]]) -> dict[str, list[dict[str, Any]]]:
    """Messages about each body, and under "" all of them as they are sent: bodies take turns, each at 30 Hz."""
    messages, counts = defaultdict(list), defaultdict(int)
    known: set[str] = set()
    for body, what in going:
        if what == "frame":
            frame = FRAMES[counts[body] % len(FRAMES)]
            message = {"type": "frame", **frame, "t": counts[body] / 30, "seq": counts[body], "body": body}
            counts[body] += 1
            known.add(body)
        elif body not in known:
            continue
        else:
            message = {"type": what, "body": body}
            if what == "body.end":
                known.discard(body)
        messages[body].append(message)
        messages[""].append(message)
    return messages


def asked(messages: list[dict[str, Any]]) -> list[tuple[str, int]]:
    """The frames among messages, by body and seq."""
    frames = [frame for message in messages for frame in message.get("frames", [message]) if "seq" in frame]
    return [(frame["body"], frame["seq"]) for frame in frames]


@proof
@given(goings)
def test_bodies_that_come_and_go_never_touch_each_other(live: Live, going: list[tuple[str, str]]) -> None:
    messages = script(going)
    sent = messages.pop("", [])
    together = asyncio.run(converse(live, sent, emotion="joy"))
    assert not [message for message in together if message["type"] == "error"]
    told = estimates(together)
    assert [(e["body"], e["seq"]) for e in told] == asked(sent), "answers come in the order of the frames"
    for body, own in messages.items():
        alone = estimates(asyncio.run(converse(live, own, emotion="joy")))
        assert [estimate for estimate in told if estimate["body"] == body] == alone


async def test_a_body_that_left_for_long_comes_back_as_somebody_new(live: Live) -> None:
    """Its place is free again after ten seconds of the other's clock; a new count of frames is not late."""
    async with talk(live) as stream:
        await stream.start(emotion="joy")
        first = await stream.follow(FRAMES[:40], body="a")
        later = [{**FRAMES[number % 120], "seq": number, "t": number / 10} for number in range(130)]
        await stream.follow(later, body="b")
        back = [{**frame, "t": frame["t"] + 13.0} for frame in FRAMES[:40]]
        again = await stream.follow(back, body="a")
    assert [e["intensity"] for e in again] == [e["intensity"] for e in first]
    assert [e["flags"] for e in again] == [["gap_reset"], *(e["flags"] for e in first[1:])]


# --- deliveries -------------------------------------------------------------------------------------------------------

parcels = st.lists(st.lists(st.sampled_from("abc"), min_size=1, max_size=8), min_size=1, max_size=30)


@proof
@given(parcels, st.booleans())
def test_latest_leaves_out_estimates_and_no_frame(live: Live, parcels: list[list[str]], one_by_one: bool) -> None:
    counts: defaultdict[str, int] = defaultdict(int)
    messages: list[dict[str, Any]] = []
    for parcel in parcels:
        frames = []
        for body in parcel:
            frames.append({**FRAMES[counts[body] % 120], "t": counts[body] / 30, "seq": counts[body], "body": body})
            counts[body] += 1
        messages += [{"type": "frame", **f} for f in frames] if one_by_one else [{"type": "frames", "frames": frames}]
    every, latest = (asyncio.run(converse(live, messages, delivery=delivery)) for delivery in ("every", "latest"))
    assert [(e["body"], e["seq"]) for e in estimates(every)] == asked(messages)
    whole = {(e["body"], e["seq"]): e for e in estimates(every)}
    newest = estimates(latest)
    assert all(whole[e["body"], e["seq"]] == e for e in newest), "the same, for every frame entered the recurrence"
    assert {e["body"]: e["seq"] for e in newest} == {body: count - 1 for body, count in counts.items()}
    if not one_by_one:
        told = [[e["body"] for e in message["estimates"]] for message in latest[:-1]]
        assert [sorted(bodies) for bodies in told] == [sorted(set(parcel)) for parcel in parcels]
    assert every[-1]["totals"]["frames"] == latest[-1]["totals"]["frames"] == sum(counts.values())
