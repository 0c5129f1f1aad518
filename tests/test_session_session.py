"""The conversation, with the real engine and without any I/O."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import as_read, host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import CloseCode, EngineError, MessageError, Overloaded
from fervor.protocol.codec import JsonCodec
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Error,
    Estimate,
    Estimates,
    Frame,
    Frames,
    Ping,
    Pong,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
)
from fervor.session.events import Close, Release, Reply, Ticket
from fervor.session.session import Session
from fervor.session.state import SessionState


class Talk:
    """A session beside its engine: events are carried out at once, in order."""

    def __init__(self, *, capacity=8, start=None, **limits):
        self.engine = Engine(model(), capacity=capacity)
        self.session = Session("s1", host(self.engine.claim, **limits))
        self.closed: Close | None = None
        if start is not None:
            assert isinstance(self.say(start)[0], SessionStarted)

    def say(self, message) -> list:
        return self.carry(self.session.receive(message))

    def carry(self, events) -> list:
        said, queue = [], list(events)
        while queue:
            match queue.pop(0):
                case Reply(message):
                    said.append(as_read(message))
                case Ticket() as ticket:
                    queue = [*self.session.conclude(ticket, self.engine.run([ticket])[0]), *queue]
                case Release(slot):
                    self.engine.release(slot)
                case Close() as close:
                    self.closed = close
        return said


def frame(seq, t=None, *, body="0", q=None, **more) -> Frame:
    rotations = motion(1, seed=seq)[0] if q is None else q
    return Frame(body=body, seq=seq, t=seq / 30 if t is None else t, q=tuple(map(tuple, rotations)), **more)


def test_a_whole_conversation():
    talk = Talk()
    (started,) = talk.say(SessionStart(emotion="joy"))
    assert (started.session_id, started.model.purpose, started.joints[0]) == ("s1", "demo", "spine")
    for seq in range(40):
        (estimate,) = talk.say(frame(seq))
        assert (estimate.seq, estimate.emotion) == (seq, "joy")
        assert 0.0 <= estimate.intensity <= 1.0
    assert estimate.status == "ok"
    (ended,) = talk.say(SessionEnd())
    assert ended.totals.frames == ended.totals.estimates == 40
    assert talk.closed == Close(CloseCode.NORMAL, "ended by the client")
    assert talk.engine.slots.taken == 0


def test_frames_in_one_message_give_the_estimates_of_single_ones():
    one, many = Talk(start=SessionStart()), Talk(start=SessionStart())
    frames = [frame(seq, body=body) for seq, body in itertools.product(range(50), "ab")]
    single = [said for item in frames for said in one.say(item)]
    (answer,) = many.say(Frames(frames=tuple(frames)))
    assert list(answer.estimates) == single


def test_latest_gives_one_estimate_a_body_and_loses_no_frame():
    every, latest = Talk(start=SessionStart()), Talk(start=SessionStart(delivery="latest"))
    frames = Frames(frames=tuple(frame(seq, body=body) for seq, body in itertools.product(range(20), "ab")))
    (all_of_them,), (newest,) = every.say(frames), latest.say(frames)
    assert newest.estimates == all_of_them.estimates[-2:]


def test_a_poisoned_frame_is_told_and_leaves_no_trace():
    clean, harmed = Talk(start=SessionStart()), Talk(start=SessionStart())
    for seq in range(10):
        expected = clean.say(frame(seq))
        nan = np.full((13, 4), np.nan)
        (error,) = harmed.say(frame(seq, q=nan))
        assert (error.code, error.seq, error.body, error.fatal) == ("bad_frame", seq, "0", False)
        (error,) = harmed.say(frame(seq, q=motion(1, joints=12)[0]))
        assert "has 12 joints in q; expected 13" in error.message
        (error,) = harmed.say(frame(seq, emotion="joie"))
        assert "'joie' is not known" in error.message
        assert harmed.say(frame(seq)) == expected
    assert harmed.session.totals.rejected == 30


def test_duplicates_and_late_frames_are_answered_and_counted():
    talk = Talk(start=SessionStart())
    first = [talk.say(frame(seq))[0] for seq in range(10)]
    (again,) = talk.say(frame(3))
    assert again == first[3].model_copy(update={"flags": ("duplicate",)})
    (late,) = talk.say(frame(20, t=0.01))
    assert "late" in late.flags
    assert late.intensity == first[-1].intensity
    totals = talk.session.totals
    assert (totals.duplicate, totals.late, totals.frames) == (1, 1, 11)


def test_a_duplicate_of_a_frame_under_way_gets_that_frames_answer():
    talk = Talk(start=SessionStart())
    tickets = [event for seq in (0, 1, 0, 2) for event in talk.session.receive(frame(seq))]
    said = [message for ticket in tickets for message in talk.carry([ticket])]
    assert said[2] == said[0].model_copy(update={"flags": ("duplicate",)})
    assert not said[3].flags
    assert talk.session.totals.duplicate == 1


def test_answers_leave_in_the_order_of_their_frames_whatever_runs_first():
    talk = Talk(start=SessionStart())
    tickets = [
        event for seq, body in ((0, "a"), (1, "a"), (0, "b")) for event in talk.session.receive(frame(seq, body=body))
    ]
    outcomes = [talk.engine.run([ticket])[0] for ticket in tickets]
    assert talk.carry(talk.session.conclude(tickets[2], outcomes[2])) == []
    assert [(m.body, m.seq) for m in talk.carry(talk.session.conclude(tickets[0], outcomes[0]))] == [("a", 0)]
    said = talk.carry(talk.session.conclude(tickets[1], outcomes[1]))
    assert [(message.body, message.seq) for message in said] == [("a", 1), ("b", 0)]


def test_the_wrong_message_at_the_wrong_time_is_fatal():
    talk = Talk()
    (error,) = talk.say(frame(0))
    assert (error.fatal, error.code) == (True, "bad_message")
    assert "expected session.start first" in error.message
    assert talk.closed.code is CloseCode.BAD_MESSAGE
    assert talk.session.state is SessionState.CLOSED
    assert talk.carry(talk.session.refuse(MessageError("more"))) == []


def test_a_second_start_is_refused():
    talk = Talk(start=SessionStart())
    (error,) = talk.say(SessionStart())
    assert "a session starts once" in error.message


def test_undecodable_messages_are_recoverable_once_started():
    talk = Talk(start=SessionStart())
    (error,) = talk.carry(talk.session.refuse(MessageError("the message is not JSON")))
    assert not error.fatal
    assert isinstance(talk.say(frame(0))[0], Estimate)


def test_undecodable_start_is_fatal():
    talk = Talk()
    (error,) = talk.carry(talk.session.refuse(MessageError("the message is not JSON")))
    assert error.fatal
    assert error.message == "the session could not start: the message is not JSON"


def test_bodies_come_and_go():
    talk = Talk(start=SessionStart(), capacity=2)
    talk.say(frame(0, body="a"))
    talk.say(frame(0, body="b"))
    (error,) = talk.say(frame(0, body="c"))
    assert (error.code, error.fatal, error.retry_after) == ("overloaded", False, 5.0)
    assert talk.say(BodyEnd(body="a")) == []
    assert isinstance(talk.say(frame(0, body="c"))[0], Estimate)
    (error,) = talk.say(BodyEnd(body="a"))
    assert "body 'a' is not known" in error.message
    (error,) = talk.say(BodyReset(body="a"))
    assert error.body == "a"
    assert not error.fatal


def test_too_many_bodies_for_one_session():
    talk = Talk(start=SessionStart(), max_bodies=2)
    talk.say(frame(0, body="a"))
    talk.say(frame(0, body="b"))
    (error,) = talk.say(frame(0, body="c"))
    assert "at most" in error.message or "one too many" in error.message


def test_an_idle_body_is_forgotten_by_the_clients_clock():
    talk = Talk(start=SessionStart(), capacity=1, body_idle_s=10.0)
    talk.say(frame(0, t=0.0, body="a"))
    assert isinstance(talk.say(frame(0, t=5.0, body="b"))[0], Error)
    assert isinstance(talk.say(frame(1, t=11.0, body="b"))[0], Estimate)


def test_a_body_that_returns_with_a_new_count_is_heard_again():
    talk = Talk(start=SessionStart())
    for seq in range(100):
        talk.say(frame(seq))
    (estimate,) = talk.say(frame(0, t=60.0))
    assert estimate.flags == ("gap_reset",)
    assert estimate.status == "warming_up"


def test_reset_equals_a_new_body():
    talk, fresh = Talk(start=SessionStart()), Talk(start=SessionStart())
    for seq in range(30):
        talk.say(frame(seq))
    talk.say(BodyReset(body="0"))
    for seq in range(30, 60):
        (one,), (other,) = talk.say(frame(seq)), fresh.say(frame(seq))
        assert one.intensity == other.intensity
    assert talk.session.totals.resets == 1


def test_ping_before_and_after_start():
    talk = Talk()
    assert talk.say(Ping(id="x")) == [Pong(id="x")]
    talk.say(SessionStart())
    assert talk.say(Ping()) == [Pong()]


def test_the_end_waits_for_what_is_under_way():
    talk = Talk(start=SessionStart())
    (ticket,) = talk.session.receive(frame(0))
    assert talk.session.receive(SessionEnd()) == []
    assert talk.session.state is SessionState.ENDING
    said = talk.carry(talk.session.conclude(ticket, talk.engine.run([ticket])[0]))
    assert [type(message) for message in said] == [Estimate, SessionEnded]


def test_a_failed_run_is_told_and_the_body_starts_anew():
    talk = Talk(start=SessionStart())
    (ticket,) = talk.session.receive(frame(0))
    (error,) = talk.carry(talk.session.conclude(ticket, EngineError("no")))
    assert (error.code, error.fatal, error.seq) == ("engine_failed", False, 0)
    assert talk.say(frame(1))[0].flags == ("reset",)


def test_a_lost_connection_frees_everything_and_ignores_late_outcomes():
    talk = Talk(start=SessionStart())
    (ticket,) = talk.session.receive(frame(0))
    assert talk.session.lost() == [Release(ticket.slot)]
    assert talk.session.conclude(ticket, talk.engine.run([ticket])[0]) == []
    assert talk.session.lost() == []


def test_too_many_frames_in_a_message():
    talk = Talk(start=SessionStart(), max_frames_per_message=3)
    (error,) = talk.say(Frames(frames=tuple(frame(seq) for seq in range(4))))
    assert "has 4 frames; this service takes at most 3" in error.message
    assert isinstance(talk.say(frame(0))[0], Estimate)


def test_a_message_of_bad_frames_only_is_answered_by_errors():
    talk = Talk(start=SessionStart())
    said = talk.say(Frames(frames=(frame(0, q=np.zeros((2, 4))), frame(1))))
    assert [type(message) for message in said] == [Error, Estimates]
    said = talk.say(Frames(frames=(frame(2, q=np.zeros((2, 4))),)))
    assert [type(message) for message in said] == [Error]


def test_full_service_says_when_to_come_back():
    def full():
        raise Overloaded("full", retry_after=3.0)

    session = Session("s", host(full))
    session.receive(SessionStart())
    (reply,) = session.receive(frame(0))
    assert reply.message.retry_after == 3.0


actions = st.one_of(
    st.builds(
        frame,
        st.integers(0, 40),
        st.floats(-20, 40),
        body=st.sampled_from("abc"),
        emotion=st.sampled_from([None, "joy", "joie", {"fear": 0.5}]),
    ),
    st.builds(
        Frames,
        frames=st.lists(st.builds(frame, st.integers(0, 40), st.floats(-20, 40)), min_size=1, max_size=4).map(tuple),
    ),
    st.builds(BodyReset, body=st.sampled_from("abc")),
    st.builds(BodyEnd, body=st.sampled_from("abc")),
    st.just(Ping()),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(actions, max_size=30))
def test_any_order_of_messages_is_answered_and_a_replay_gives_the_same_bits(messages):
    codec = JsonCodec()
    transcripts = []
    for _ in range(2):
        talk = Talk(start=SessionStart(emotion="joy"), capacity=3)
        said = [message for item in [*messages, SessionEnd()] for message in talk.say(item)]
        transcripts.append([codec.encode(message) for message in said])
        assert isinstance(said[-1], SessionEnded)
        assert talk.engine.slots.taken == 0
        estimates = [
            e for m in said for e in (m.estimates if isinstance(m, Estimates) else [m]) if isinstance(e, Estimate)
        ]
        errors = [m for m in said if isinstance(m, Error) and m.seq is not None]
        asked = [f for m in messages for f in (m.frames if isinstance(m, Frames) else [m]) if isinstance(f, Frame)]
        assert len(estimates) + len(errors) == len(asked)
    assert transcripts[0] == transcripts[1]


@pytest.mark.parametrize("memory", ["staggered", "stateful"])
def test_an_interrupted_and_an_uninterrupted_queue_agree(memory):
    """Submitting frames faster than they run changes nothing."""
    slow, fast = Talk(start=SessionStart(memory=memory)), Talk(start=SessionStart(memory=memory))
    frames = [frame(seq) for seq in range(30)]
    expected = [talked for item in frames for talked in slow.say(item)]
    tickets = [event for item in frames for event in fast.session.receive(item)]
    assert [said for ticket in tickets for said in fast.carry([ticket])] == expected
