"""Frames taken promptly come to what they come to otherwise, to the bit and to the byte."""

import hashlib
from dataclasses import replace

import msgpack
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import as_read, host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import EngineError
from fervor.protocol.codec import MsgpackCodec
from fervor.protocol.lean_frame import LeanFrame
from fervor.session.events import Close, Release, Reply, Ticket
from fervor.session.following import MOST_PROMPT
from fervor.session.poses import read_poses
from fervor.session.session import Session
from fervor.session.spread import Spread

CODEC = MsgpackCodec()
POSES = motion(12, seed=3).astype("<f4")

FRAMES = st.fixed_dictionaries(
    {
        "type": st.just("frame"),
        "body": st.sampled_from(["ann", "ann", "bob"]),
        "step": st.sampled_from([1, 1, 1, 1, 0, -1, 3]),
        "seconds": st.sampled_from([1 / 30, 1 / 30, 0.03, 0.07, 0.4, 2.0, -0.01, 20.0]),
        "q": st.sampled_from([pose.tobytes() for pose in POSES] + [bytes(208), b"\xff" * 208, b"short"]),
        "emotion": st.sampled_from([None, None, None, None, "anger", {"joy": 0.5}, "nonsense"]),
    }
)
MESSAGES = (
    FRAMES.map(lambda frame: [frame])
    | st.lists(FRAMES, min_size=1, max_size=MOST_PROMPT + 2)
    | st.sampled_from(
        [
            {"type": "body.reset", "body": "ann"},
            {"type": "body.end", "body": "bob"},
            {"type": "session.calibrate", "body": "ann", "seconds": 0.2},
            {"type": "session.end"},
        ]
    )
)
STARTS = st.fixed_dictionaries(
    {},
    optional={
        "checkpoint_s": st.sampled_from([0.1, 0.5]),
        "delivery": st.just("latest"),
        "memory": st.sampled_from(["stateful", "window"]),
        "clock": st.just("frames"),
        "by_emotion": st.just(True),
        "emotion": st.just({"joy": 0.9}),
    },
)


def seal(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


class Service:
    """A session with an engine of its own, promptly or not."""

    def __init__(self, start, *, promptly: bool) -> None:
        self.engine = Engine(model(), capacity=2)
        self.spread = Spread()
        service = replace(host(self.engine.claim, max_bodies=2), seal=seal, spread=self.spread)
        self.session = Session("s", service)
        self.promptly = promptly
        self.said: list[object] = []
        self.prompted = 0
        self.hear({"type": "session.start", **start})

    def hear(self, message) -> None:
        self.spread.begin()
        data = msgpack.packb(message)
        lean, agreement = CODEC.decode_frames(data), self.session.agreement
        if lean is None or agreement is None:
            self.carry(self.session.receive(CODEC.decode_client(data)))
            return
        frames = (lean,) if isinstance(lean, LeanFrame) else lean.frames
        poses = read_poses([(agreement, frame) for frame in frames])
        tickets = self.session.prompt(lean, poses) if self.promptly else ()
        if tickets:
            self.prompted += len(tickets)
            self.said += map(as_read, self.session.answer(tickets, [self.run(ticket) for ticket in tickets]))
        else:
            self.carry(self.session.receive(lean, poses))

    def carry(self, events) -> None:
        queue = list(events)
        while queue:
            match queue.pop(0):
                case Reply(message):
                    self.said.append(as_read(message))
                case Ticket() as ticket:
                    queue = [*queue, *self.session.conclude(ticket, self.run(ticket))]
                case Release(slot):
                    self.engine.release(slot)
                case Close(code, _):
                    self.said.append(code)

    def run(self, ticket):
        if ticket.seq % 13 == 12:
            return EngineError("thirteen")
        return self.engine.run([ticket])[0]


def told(script):
    """Frames numbered and timed as their steps have it."""
    seq, t = 0, 100.0
    for message in script:
        if isinstance(message, dict):
            yield message
            continue
        frames = []
        for frame in message:
            seq, t = max(seq + frame["step"], 0), t + frame["seconds"]
            more = {} if frame["emotion"] is None else {"emotion": frame["emotion"]}
            frames.append({"type": "frame", "body": frame["body"], "seq": seq, "t": t, "q": frame["q"], **more})
        yield frames[0] if len(frames) == 1 else {"type": "frames", "frames": frames}


@settings(max_examples=150, deadline=None)
@given(start=STARTS, script=st.lists(MESSAGES, max_size=30))
def test_prompt_frames_come_to_what_others_come_to(start, script):
    prompt, plain = (Service(start, promptly=promptly) for promptly in (True, False))
    for message in told(script):
        prompt.hear(message)
        plain.hear(message)
        assert prompt.said == plain.said
    assert prompt.session.totals == plain.session.totals
    assert not plain.prompted


def test_nearly_all_frames_are_prompt():
    service = Service({"checkpoint_s": 0.5, "emotion": "joy"}, promptly=True)
    usual = {"body": "ann", "step": 1, "seconds": 1 / 30, "q": POSES[0].tobytes(), "emotion": None}
    for message in told([[usual]] * 40 + [[usual] * 6] * 10 + [[usual] * (MOST_PROMPT + 1)]):
        service.hear(message)
    assert service.prompted == 39 + 60
    assert service.session.totals.frames == 100 + MOST_PROMPT + 1


def test_the_checkpoint_of_a_message_goes_with_the_last_frame_of_its_body():
    """So that the frames before need no copy of what the engine holds, and may run together."""
    for promptly in (True, False):
        service = Service({"checkpoint_s": 0.1, "emotion": "joy"}, promptly=promptly)
        own = {"step": 1, "seconds": 1 / 60, "q": POSES[0].tobytes(), "emotion": None}
        message = [{**own, "body": name} for name in ["ann", "bob", "ann", "bob", "ann"]]
        for each in told([message, message]):
            service.hear(each)
        kept = [(each.body, each.seq) for each in service.said if each.type == "checkpoint"]
        assert kept == [("bob", 4), ("ann", 5), ("bob", 9), ("ann", 10)]
