"""Whatever one client sends, it is told so in a sentence, and a session beside it does not lose a bit."""

import asyncio
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import pytest

from bodies import motion
from fervor.session.events import Event
from fervor.session.poses import Read
from fervor.session.session import Incoming, Session
from live import Live, RawClient, frames_of, talk

HEALTHY = frames_of(motion(60, seed=5))
POSE = motion(1)[0].tolist()
IDENTITY = [0.0, 0.0, 0.0, 1.0]


def frame(**changes) -> str:
    return json.dumps({"type": "frame", "seq": 0, "t": 0.0, "q": POSE, **changes})


@pytest.fixture(scope="session")
def expected(live: Live) -> list[dict]:
    """The healthy session's estimates, undisturbed."""

    async def follow() -> list[dict]:
        async with talk(live) as stream:
            await stream.start(emotion="joy")
            return await stream.follow(HEALTHY)

    with ThreadPoolExecutor() as pool:
        return pool.submit(asyncio.run, follow()).result()


RECOVERABLE = {
    "not a number": (frame(q=[[float("nan"), 0, 0, 1], *POSE[1:]]), "bad_frame", "at joint 0 (spine)"),
    "infinity": (frame().replace(str(POSE[0][0]), "1e999", 1), "bad_frame", "expected four finite numbers"),
    "not unit": (frame(q=[[9.0, 9.0, 9.0, 9.0], *POSE[1:]]), "bad_frame", "far from unit length at joint 0"),
    "too few joints": (frame(q=POSE[1:]), "bad_frame", "has 12 joints in q; expected 13"),
    "too many joints": (frame(q=[*POSE, IDENTITY]), "bad_frame", "has 14 joints in q; expected 13"),
    "mask too short": (frame(mask=[True]), "bad_frame", "has 1 entries in mask; expected 13"),
    "time is not finite": (frame(t=float("nan")), "bad_frame", "frame.t"),
    "no time": (frame(t=None), "bad_frame", "clock 'time' needs seconds"),
    "no seq": ('{"type": "frame", "t": 0, "q": []}', "bad_message", "seq is missing"),
    "negative seq": (frame(seq=-1), "bad_message", "seq"),
    "seq beyond all numbers": (frame(seq=2**70), "bad_message", "seq"),
    "unknown emotion": (frame(emotion="jooy"), "bad_input", "'jooy' is not known; expected one of amusement"),
    "impossible probability": (frame(emotion={"joy": -1.0}), "bad_input", "probability -1.0"),
    "unknown field": (frame(colour="red"), "bad_frame", "colour is not a field of this message"),
    "unknown body": ('{"type": "body.reset", "body": "nobody"}', "bad_frame", "body 'nobody' is not known"),
    "unknown type": ('{"type": "frame.please"}', "bad_message", "type is not known"),
    "no type": ("{}", "bad_message", "type"),
    "not an object": ("[1, 2]", "bad_message", "input should be"),
    "not JSON": ("frame 0: fine", "bad_message", "the message is not JSON"),
    "nothing": ("", "bad_message", "the message is not JSON"),
    "truncated": (frame()[:100], "bad_message", "the message is not JSON"),
    "deep": ("[" * 50_000, "bad_message", "the message is not JSON"),
    "deep and whole": ("[" * 50_000 + "]" * 50_000, "bad_message", "the message is not JSON"),
    "half a character": ('{"type": "ping", "id": "\\ud800"}', "bad_message", "the message is not JSON"),
    "binary": (b"\x00\x01\x02", "bad_message", "takes text messages, but 3 bytes of binary came"),
    "a body with no name": (frame(body=""), "bad_message", "body"),
}


@pytest.mark.parametrize(("poison", "code", "sentence"), RECOVERABLE.values(), ids=RECOVERABLE)
async def test_a_poisoned_message_is_told_and_survived(
    poison: str | bytes, code: str, sentence: str, live: Live, expected: list[dict]
) -> None:
    async with talk(live) as sick, talk(live) as healthy:
        await sick.start()
        await healthy.start(emotion="joy")
        before = await healthy.follow(HEALTHY[:30])
        await sick.socket.send(poison)
        error = await sick.hear()
        assert (error["type"], error["code"], error["fatal"]) == ("error", code, False)
        assert sentence in error["message"]
        assert "\n" not in error["message"]
        assert len(error["message"]) < 500
        assert len(await sick.follow(HEALTHY[:2])) == 2
        assert before + await healthy.follow(HEALTHY[30:]) == expected


FATAL = {
    "a frame before the start": (frame(), 4400, "frame came at the wrong time; expected session.start first"),
    "not JSON before the start": ("hello", 4400, "the session could not start"),
    "unknown skeleton": ('{"type": "session.start", "skeleton": "octopus"}', 4400, "skeleton 'octopus' is not known"),
    "unknown joint": ('{"type": "session.start", "joints": ["tail"]}', 4400, "has no joint 'tail'"),
    "unknown emotion": ('{"type": "session.start", "emotion": "jooy"}', 4400, "emotion 'jooy' is not known"),
    "wrong clock": ('{"type": "session.start", "clock": "sundial"}', 4400, "clock"),
}


@pytest.mark.parametrize(("poison", "close", "sentence"), FATAL.values(), ids=FATAL)
async def test_a_session_that_cannot_start_is_told_and_closed(
    poison: str, close: int, sentence: str, live: Live
) -> None:
    async with talk(live) as sick:
        await sick.socket.send(poison)
        error = await sick.hear()
        assert error["fatal"]
        assert sentence in error["message"]
        assert (await sick.closed())[0] == close


async def test_a_second_start_ends_the_session(live: Live) -> None:
    async with talk(live) as sick:
        await sick.start()
        assert "a session starts once" in (await sick.start())["message"]
        assert (await sick.closed())[0] == 4400


async def test_bytes_that_are_no_text_close_with_1007(live: Live, expected: list[dict]) -> None:
    async with talk(live) as healthy:
        await healthy.start(emotion="joy")
        sick = RawClient(live)
        sick.send(b'{"type": "ping", "id": "\xff\xfe"}')
        sick.read_until((1007).to_bytes(2, "big"))
        sick.socket.close()
        assert await healthy.follow(HEALTHY) == expected


async def test_a_hundred_megabytes_close_with_1009_unread(live: Live, expected: list[dict]) -> None:
    async with talk(live) as healthy:
        await healthy.start(emotion="joy")
        sick = RawClient(live)
        sick.socket.sendall(b"\x81\xff" + (100_000_000).to_bytes(8, "big") + b"\0\0\0\0" + b"x" * 10_000)
        sick.read_until((1009).to_bytes(2, "big"))
        sick.socket.close()
        assert await healthy.follow(HEALTHY) == expected


async def test_a_fault_of_ours_ends_one_session_only(
    live: Live, expected: list[dict], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with talk(live) as sick, talk(live) as healthy:
        await sick.start()
        await healthy.start(emotion="joy")
        good = Session.receive

        def fails_on_an_end(self: Session, message: Incoming, poses: Sequence[Read] = ()) -> list[Event]:
            assert message.type != "body.end"
            return good(self, message, poses)

        monkeypatch.setattr(Session, "receive", fails_on_an_end)
        await sick.follow(HEALTHY[:1])
        await sick.send("body.end", body="0")
        assert (await sick.hear())["message"] == "the service failed on this session; the fault is its own"
        assert (await sick.closed())[0] == 1011
        assert await healthy.follow(HEALTHY) == expected
