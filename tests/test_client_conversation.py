import logging
import math
from itertools import count

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fervor_client.answers as module
from fervor.errors import EngineError, FrameError, InputError, ProtocolError, RateExceeded, Unreachable
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import (
    Error,
    Estimate,
    Estimates,
    Frame,
    Limits,
    ModelInfo,
    Ping,
    Pong,
    ServerMessage,
    SessionEnded,
    SessionStarted,
    Totals,
)
from fervor_client.conversation import Conversation
from fervor_client.options import Options, opening
from fervor_client.standing import State

CODEC = CODECS["fervor.v1.json"]
POSE = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
STARTED = SessionStarted(
    session_id="s",
    model=ModelInfo(
        name="m", version="1", purpose="demo", sha256="0", rate_hz=30.0, emotions=("joy",), thresholds={"joy": 0.5}
    ),
    limits=Limits(),
    joints=("head", "l_elbow"),
    fingerprint="f",
)


def estimate(seq: int, body: str = "0") -> Estimate:
    return Estimate(body=body, seq=seq, t=0.0, intensity=seq / 100, level=None, emotion="joy", status="ok")


def hear(conversation: Conversation, *messages: ServerMessage) -> list[Exception]:
    return [error for message in messages for error in conversation.receive(CODEC.encode(message))]


def sent(conversation: Conversation) -> Frame:
    frame = CODEC.decode_client(conversation.next_payload() or "")
    assert isinstance(frame, Frame)
    return frame


def start(**options: object) -> Conversation:
    clock = count(10)
    conversation = Conversation(opening("c13", None, Options(**options)), url="ws://x", now=lambda: float(next(clock)))
    conversation.start()
    hear(conversation, STARTED)
    return conversation


def test_a_conversation_goes_through_its_states() -> None:
    conversation = Conversation(opening("kinect_v2", "joy", Options(by_emotion=True)), url="ws://x")
    assert conversation.state is State.NEW
    opened = CODEC.decode_client(conversation.start())
    assert (opened.skeleton, opened.emotion, opened.by_emotion) == ("kinect_v2", "joy", True)
    assert conversation.state is State.STARTING
    hear(conversation, STARTED)
    assert conversation.state is State.OPEN
    conversation.end()
    assert CODEC.decode_client(conversation.next_payload() or "").type == "session.end"
    assert conversation.state is State.ENDING
    hear(conversation, SessionEnded(reason="bye", totals=Totals(frames=3)))
    assert conversation.over
    assert conversation.failure is None
    assert conversation.totals == Totals(frames=3)


def test_seq_and_time_are_filled_in_per_body() -> None:
    conversation = start()
    for body in ("a", "b", "a", "a", "b"):
        conversation.frame(POSE, body=body)
    frames = [sent(conversation) for _ in range(5)]
    assert [(frame.body, frame.seq) for frame in frames] == [("a", 0), ("b", 0), ("a", 1), ("a", 2), ("b", 1)]
    assert [frame.t for frame in frames] == [10.0, 11.0, 12.0, 13.0, 14.0]


def test_a_seq_of_the_caller_goes_on_from_there_and_never_back() -> None:
    conversation = start()
    seqs = [conversation.frame(POSE, seq=seq) for seq in (7, None, 3, None)]
    assert seqs == [7, 8, 3, 9]


def test_everything_given_is_sent() -> None:
    conversation = start()
    number = conversation.frame(
        POSE, body="a", seq=4, t=np.float32(1.5), emotion={"joy": 0.25}, mask=np.array([True, False])
    )
    frame = sent(conversation)
    assert number == 4
    assert (frame.body, frame.seq, frame.t, frame.emotion, frame.mask) == ("a", 4, 1.5, {"joy": 0.25}, (True, False))
    assert frame.q == ((0.0, 0.0, 0.0, 1.0),) * 2


@given(st.permutations(range(8)))
def test_answers_find_their_frames_in_whatever_order_they_come(order: list[int]) -> None:
    conversation = start()
    for seq in range(8):
        conversation.frame(POSE, awaited=seq % 2 == 0)
    assert conversation.in_flight == 8
    hear(conversation, *(estimate(seq) for seq in order))
    assert conversation.in_flight == 0
    assert all(conversation.take(("0", seq)) == estimate(seq) for seq in (0, 2, 4, 6))
    read = [conversation.next_estimate() for _ in range(5)]
    assert read == [*(estimate(seq) for seq in order if seq % 2), None]


def test_equal_seqs_of_two_bodies_are_kept_apart() -> None:
    conversation = start()
    for body in ("a", "b"):
        conversation.frame(POSE, body=body, awaited=True)
    hear(conversation, estimate(0, "b"))
    assert conversation.take(("a", 0)) is None
    assert conversation.take(("b", 0)) == estimate(0, "b")


def test_estimates_in_one_message_are_taken_one_by_one() -> None:
    conversation = start()
    conversation.frame(POSE)
    conversation.frame(POSE, awaited=True)
    hear(conversation, Estimates(estimates=(estimate(0), estimate(1))))
    assert conversation.next_estimate() == estimate(0)
    assert conversation.take(("0", 1)) == estimate(1)


def test_a_skipped_frame_is_answered_by_the_newer_estimate_under_delivery_latest() -> None:
    conversation = start(delivery="latest")
    for body in ("a", "a", "a", "b"):
        conversation.frame(POSE, body=body, awaited=True)
    hear(conversation, estimate(1, "a"))
    assert conversation.in_flight == 2
    assert conversation.take(("a", 0)) == conversation.take(("a", 1)) == estimate(1, "a")
    assert conversation.take(("a", 2)) is conversation.take(("b", 0)) is None


def test_an_awaited_frame_raises_its_error_at_its_place() -> None:
    conversation = start()
    conversation.frame(POSE, awaited=True)
    refusal = Error(code="bad_frame", message="frame 0 is bad", fatal=False, body="0", seq=0)
    assert hear(conversation, refusal) == []
    with pytest.raises(FrameError, match="frame 0 is bad"):
        conversation.take(("0", 0))
    assert conversation.in_flight == 0
    assert conversation.state is State.OPEN


def test_errors_that_nobody_awaits_are_handed_out() -> None:
    conversation = start()
    conversation.frame(POSE)
    first, second = hear(
        conversation,
        Error(code="engine_failed", message="the model failed", fatal=False, body="0", seq=0),
        Error(code="bad_frame", message="body 'x' is not known", fatal=False, body="x"),
    )
    assert isinstance(first, EngineError)
    assert isinstance(second, FrameError)
    assert conversation.in_flight == 0


def test_a_fatal_error_ends_it_but_what_came_before_can_be_read() -> None:
    conversation = start()
    conversation.frame(POSE)
    conversation.frame(POSE, awaited=True)
    hear(conversation, estimate(0), Error(code="rate_exceeded", message="too fast", fatal=True), estimate(1))
    assert conversation.over
    assert conversation.next_estimate() == estimate(0)
    for call in (
        conversation.next_estimate,
        lambda: conversation.take(("0", 1)),
        lambda: conversation.frame(POSE),
        conversation.end,
        lambda: conversation.reset_body("0"),
    ):
        with pytest.raises(RateExceeded, match="too fast"):
            call()


def test_an_end_without_an_answer_is_said_to_who_awaits_it() -> None:
    conversation = start()
    conversation.frame(POSE, awaited=True)
    hear(conversation, SessionEnded(reason="bye", totals=Totals()))
    with pytest.raises(Unreachable, match="ended before frame 0 was answered"):
        conversation.take(("0", 0))
    assert conversation.next_estimate() is None


@pytest.mark.parametrize("payload", ["not json", b"\x00", '{"type": "estimate"}', '{"type": 3}', "[1]"])
def test_a_message_that_cannot_be_read_ends_it(payload: str | bytes) -> None:
    conversation = start()
    conversation.receive(payload)
    assert isinstance(conversation.failure, ProtocolError)
    assert "ws://x sent what this client can't read" in conversation.failure.message


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [
        ({"q": np.zeros((3, 4))}, r"frame 0 of body '0': the pose has the shape \[3, 4\]; expected \[2, 4\]"),
        ({"q": np.full((2, 4), math.inf)}, r"joint 0 \(head\) holds an infinite number"),
        ({"t": math.nan}, "t: "),
        ({"seq": -1}, "seq: "),
        ({"body": ""}, "body: "),
        ({"body": "x" * 65}, "body: "),
        ({"emotion": "x" * 33}, "emotion"),
    ],
)
def test_a_bad_frame_is_refused_before_it_is_sent(bad: dict[str, object], sentence: str) -> None:
    conversation = start()
    with pytest.raises(FrameError, match=sentence):
        conversation.frame(bad.pop("q", POSE), **bad)  # type: ignore[arg-type]
    assert conversation.in_flight == 0
    assert conversation.frame(POSE) == 0


def test_nothing_can_be_sent_before_the_start_or_after_the_end() -> None:
    conversation = Conversation(opening("c13", None, Options()), url="ws://x")
    with pytest.raises(Unreachable, match="has not started"):
        conversation.frame(POSE)
    conversation = start()
    conversation.end()
    with pytest.raises(Unreachable, match="has ended; connect again"):
        conversation.frame(POSE)


def test_a_given_up_answer_is_read_like_the_others() -> None:
    conversation = start()
    conversation.frame(POSE, awaited=True)
    conversation.give_up(("0", 0))
    hear(conversation, estimate(0))
    assert conversation.next_estimate() == estimate(0)


def test_memory_is_bounded_where_nobody_reads(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "UNREAD", 3)
    conversation = start()
    with caplog.at_level(logging.WARNING):
        hear(conversation, *(estimate(seq) for seq in range(10)))
    assert len(caplog.records) == 1
    assert [conversation.next_estimate() for _ in range(4)] == [estimate(7), estimate(8), estimate(9), None]


def test_a_message_of_a_type_from_the_future_is_passed_over() -> None:
    conversation = start()
    assert conversation.receive('{"type": "surprise", "body": 3}') == []
    assert conversation.state is State.OPEN


def test_a_frame_under_way_is_not_sent_twice() -> None:
    conversation = start()
    conversation.frame(POSE, seq=3)
    with pytest.raises(FrameError, match="frame 3 of body '0' is under way"):
        conversation.frame(POSE, seq=3)
    hear(conversation, estimate(3))
    assert conversation.frame(POSE, seq=3) == 3


def test_a_ping_is_sent_and_its_pong_says_nothing() -> None:
    conversation = start()
    assert CODEC.decode_client(conversation.ping()) == Ping()
    assert hear(conversation, Pong()) == []


@pytest.mark.parametrize("options", [{"clock": "sundial"}, {"nominal_hz": -1}, {"colour": "red"}, {"joints": 3}])
def test_impossible_options_are_refused_in_a_sentence(options: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(options))):
        opening("c13", None, Options(**options))
