"""A body resumed elsewhere goes on to the bit, wherever it was cut."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import as_read, host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import CheckpointMismatch, CheckpointUnknown
from fervor.model import Model, Outputs, default_model_path
from fervor.protocol.messages import (
    BodyEnd,
    Checkpoint,
    Error,
    Estimate,
    Frame,
    Frames,
    SessionCalibrate,
    SessionStart,
    SessionStarted,
)
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.session.answers import Answers
from fervor.session.checkpoint import Bond, Bookkeeping, Memory, pack, unpack
from fervor.session.events import Close, Release, Reply, Restore, Ticket
from fervor.session.sealing import Sealer
from fervor.session.session import Session

SEALER = Sealer((b"key",), 60.0)


class Replica:
    """A service with the common key, and one session on it."""

    def __init__(self, runtime: Model | None = None, **limits) -> None:
        runtime = runtime or model()
        self.engine = Engine(runtime, capacity=8)
        base = host(self.engine.claim, **limits)
        self.session = Session(
            "s",
            type(base)(
                base.model,
                base.metadata,
                base.limits,
                runtime.fingerprint,
                base.claim,
                seal=lambda content: SEALER.seal(content, 0.0),
                unseal=lambda token: SEALER.open(token, 1.0),
            ),
        )
        self.closed: Close | None = None

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
                case Restore(slot, memory):
                    self.engine.restore(slot, memory)
                case Release(slot):
                    self.engine.release(slot)
                case Close() as close:
                    self.closed = close
        return said


def estimates(said) -> list[Estimate]:
    return [message for message in said if isinstance(message, Estimate)]


def run(replica: Replica, frames) -> list:
    return [said for frame in frames for said in replica.say(frame)]


def a_life(seed: int, *, count: int = 260, joints: int = 13, body: str = "eve") -> list[Frame]:
    """Frames with jitter, gaps, lost joints, labels that come and expire."""
    random = np.random.default_rng(seed)
    times = np.cumsum(random.choice([0.01, 0.033, 0.034, 0.3, 0.7, 1.4], count, p=[0.1, 0.4, 0.44, 0.03, 0.02, 0.01]))
    poses = motion(count, seed=seed, joints=joints)
    labels = [None, "joy", {"fear": 0.6, "joy": 0.3}, "unknown"]
    return [
        Frame(
            body=body,
            seq=seq,
            t=float(times[seq]),
            q=tuple(tuple(q) if random.random() > 0.03 else None for q in poses[seq]),
            emotion=labels[random.integers(4)] if random.random() < 0.05 else None,
        )
        for seq in range(count)
    ]


@pytest.mark.parametrize("memory", ["staggered", "stateful", "window"])
@pytest.mark.parametrize("skeleton", ["c13", "kinect_v2"])
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 1000), cuts=st.lists(st.integers(1, 259), min_size=1, max_size=4, unique=True))
def test_resumed_equals_uninterrupted_to_the_bit(memory, skeleton, seed, cuts):
    start = SessionStart(skeleton=skeleton, memory=memory, checkpoint_s=1.0, emotion="joy", by_emotion=True)
    frames = a_life(seed, joints=25 if skeleton == "kinect_v2" else 13)
    whole = Replica()
    whole.say(start)
    expected = {estimate.seq: estimate for estimate in estimates(run(whole, frames))}

    got: dict[int, Estimate] = {}
    replica, token, after = Replica(), None, 0
    replica.say(start)
    for cut in [*sorted(cuts), len(frames)]:
        for said in run(replica, frames[after:cut]):
            if isinstance(said, Checkpoint):
                token, after = said.token, said.seq + 1
            elif isinstance(said, Estimate):
                assert got.setdefault(said.seq, said) == said  # a replay repeats, to the bit
        replica = Replica()  # the other one was killed here
        (started,) = replica.say(start.model_copy(update={"resume": (token,)} if token else {}))
        assert isinstance(started, SessionStarted)
        if token:
            assert [(r.body, r.seq, r.same_runtime) for r in started.resumed] == [("eve", after - 1, True)]
    assert got == expected


def test_a_checkpoint_a_second_and_none_unless_asked():
    asked, silent = Replica(), Replica()
    asked.say(SessionStart(checkpoint_s=1.0))
    silent.say(SessionStart())
    frames = [Frame(seq=k, t=k / 30, q=tuple(map(tuple, motion(1)[0]))) for k in range(151)]
    kept = [said for said in run(asked, frames) if isinstance(said, Checkpoint)]
    assert [checkpoint.seq for checkpoint in kept] == [0, 30, 60, 90, 120, 150]
    assert not any(isinstance(said, Checkpoint) for said in run(silent, frames))


def test_the_last_checkpoint_of_a_drain_covers_everything():
    replica, start = Replica(), SessionStart(checkpoint_s=60.0)
    replica.say(start)
    frames = a_life(3)
    run(replica, frames[:200])
    (last,) = replica.carry(replica.session.checkpoints())
    assert last.seq == 199
    assert not replica.session.busy
    whole, other = Replica(), Replica()
    whole.say(start)
    other.say(start.model_copy(update={"resume": (last.token,)}))
    assert estimates(run(whole, frames))[200:] == estimates(run(other, frames[200:]))


class OtherKind(Model):
    """The same file on a CPU that rounds otherwise: all that a call gives is one unit in the last place higher."""

    def run(self, rotations, mask, emotion, states) -> Outputs:
        given = super().run(rotations, mask, emotion, states)
        higher = {name: np.nextafter(state, np.float32(np.inf)) for name, state in given.states.items()}
        one = np.float32(1.0)
        return Outputs(np.nextafter(given.intensity, one), np.nextafter(given.intensity_by_emotion, one), higher)


@pytest.mark.parametrize("memory", ["staggered", "stateful", "window"])
def test_another_kind_of_cpu_says_so_and_goes_on_to_a_millionth(memory):
    other = OtherKind.load(default_model_path())
    other.fingerprint = "another"
    start, frames = SessionStart(memory=memory, checkpoint_s=1.0, emotion="joy"), a_life(3)
    whole, before, after = Replica(), Replica(), Replica(other)
    whole.say(start)
    before.say(start)
    expected = estimates(run(whole, frames))
    token = [said for said in run(before, frames[:130]) if isinstance(said, Checkpoint)][-1]
    (started,) = after.say(start.model_copy(update={"resume": (token.token,)}))
    assert (started.fingerprint, started.resumed[0].same_runtime) == ("another", False)
    got = estimates(run(after, frames[token.seq + 1 :]))
    differences = [abs(one.intensity - two.intensity) for one, two in zip(got, expected[token.seq + 1 :], strict=True)]
    assert 0.0 < max(differences) <= 1e-6
    same = [[each.model_copy(update={"intensity": 0.0}) for each in some] for some in (got, expected[token.seq + 1 :])]
    assert same[0] == same[1]


def test_several_bodies_resume_together():
    replica, start = Replica(), SessionStart(checkpoint_s=1.0)
    replica.say(start)
    lives = [a_life(seed, body=name, count=90) for seed, name in enumerate("abc")]
    mixed = [frame for trio in zip(*lives, strict=True) for frame in trio]
    tokens = {said.body: said for said in run(replica, mixed) if isinstance(said, Checkpoint)}
    other = Replica()
    (started,) = other.say(start.model_copy(update={"resume": tuple(kept.token for kept in tokens.values())}))
    assert {r.body: r.seq for r in started.resumed} == {name: kept.seq for name, kept in tokens.items()}
    assert other.engine.slots.taken == 3


@pytest.mark.parametrize(
    ("changes", "code", "close"),
    [
        ({"memory": "stateful"}, "checkpoint_mismatch", 4410),
        ({"emotion": "fear"}, "checkpoint_mismatch", 4410),
        ({"skeleton": "kinect_v2"}, "checkpoint_mismatch", 4410),
        ({"resume": ("garbage",)}, "checkpoint_unknown", 4404),
    ],
)
def test_other_terms_or_garbage_are_refused_and_hold_nothing(changes, code, close):
    replica, start = Replica(), SessionStart(checkpoint_s=1.0)
    replica.say(start)
    (kept,) = [s for s in replica.say(a_life(1)[0]) if isinstance(s, Checkpoint)]
    other = Replica()
    (error,) = other.say(start.model_copy(update={"resume": (kept.token,), **changes}))
    assert isinstance(error, Error)
    assert (error.code, error.fatal, other.closed.code) == (code, True, close)
    assert other.engine.slots.taken == 0


def test_the_same_body_twice_is_refused():
    replica, start = Replica(), SessionStart(checkpoint_s=1.0)
    replica.say(start)
    (kept,) = [s for s in replica.say(a_life(1)[0]) if isinstance(s, Checkpoint)]
    (error,) = Replica().say(start.model_copy(update={"resume": (kept.token, kept.token)}))
    assert "names a body twice" in error.message


BODY = Bookkeeping(
    name="e",
    newest_seq=1,
    timeline=None,
    last=None,
    label=((0.0,) * 11, "unknown", None),
    pending=(),
    level=None,
    emotion="joy",
)


def test_another_model_is_a_mismatch_another_runtime_is_told():
    data = pack(Bond("m", "f", "t"), BODY, Answers("e").to_bytes(), Memory({"x": np.arange(3.0)}))
    opened = unpack(data, Bond("m", "g", "t"))
    assert not opened.same_runtime
    assert opened.memory.arrays["x"].tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(CheckpointMismatch, match="of another model file"):
        unpack(data, Bond("n", "f", "t"))


@given(st.binary(max_size=300))
def test_no_bytes_raise_anything_else(data):
    with pytest.raises(CheckpointUnknown):
        unpack(data, Bond("m", "f", "t"))


def still(seq: int, *, body: str = "eve", joints: int = 25, **more) -> Frame:
    return Frame(body=body, seq=seq, t=seq / 30, q=((0.0, 0.0, 0.0, 1.0),) * joints, **more)


def kinds(said) -> list[str]:
    return [message.type for message in said]


def test_a_duplicate_of_a_frame_before_the_checkpoint_gets_its_answer_again():
    replica, start = Replica(), SessionStart(checkpoint_s=1.0)
    replica.say(start)
    life = a_life(5, count=90)
    said = run(replica, life)
    token = [message for message in said if isinstance(message, Checkpoint)][-1]
    expected = replica.say(life[token.seq - 20])
    other = Replica()
    other.say(start.model_copy(update={"resume": (token.token,)}))
    assert other.say(life[token.seq - 20]) == expected
    assert expected[0].flags[-1] == "duplicate"


def test_a_late_frame_brings_no_label():
    replica = Replica()
    replica.say(SessionStart(skeleton="kinect_v2", emotion="joy"))
    run(replica, [still(0), still(5)])
    (late,) = replica.say(still(3, emotion="fear"))
    (after,) = replica.say(still(6))
    assert ("late" in late.flags, after.emotion) == (True, "joy")


def test_a_checkpoint_comes_after_the_answers_of_its_message():
    replica = Replica()
    replica.say(SessionStart(checkpoint_s=0.1))
    said = replica.say(Frames(frames=tuple(a_life(1, count=20))))
    assert kinds(said) == ["estimates", "checkpoint"]
    assert said[1].seq <= said[0].estimates[-1].seq


def test_a_calibration_follows_its_last_frame_and_brings_checkpoints():
    replica = Replica()
    replica.say(SessionStart(skeleton="kinect_v2", checkpoint_s=0.1))
    run(replica, [still(0), still(1, body="bob")])
    replica.say(SessionCalibrate(body="eve", seconds=0.3))
    said = run(replica, [still(seq) for seq in range(2, 12)])
    assert kinds(said) == [*["estimate"] * 10, "session.calibrated"]
    checkpoints = said[10].checkpoints
    assert [message.body for message in checkpoints] == ["eve", "bob"]
    start = SessionStart(skeleton=said[10].skeleton, checkpoint_s=0.1)
    (started,) = Replica().say(start.model_copy(update={"resume": tuple(message.token for message in checkpoints)}))
    assert [(body.body, body.seq) for body in started.resumed] == [("eve", 11), ("bob", 1)]


def test_a_calibration_inside_a_message_brings_checkpoints_of_all_its_frames():
    replica = Replica()
    replica.say(SessionStart(skeleton="kinect_v2", checkpoint_s=60.0))
    run(replica, [still(0), still(1, body="bob")])
    replica.say(SessionCalibrate(body="eve", seconds=0.3))
    said = replica.say(Frames(frames=(*(still(seq) for seq in range(2, 20)), still(20, body="bob"))))
    assert kinds(said) == ["estimates", "session.calibrated"]
    assert said[1].frames < 18, "it was over before the message was"
    assert {message.body: message.seq for message in said[1].checkpoints} == {"eve": 19, "bob": 20}


def test_a_calibration_ends_with_its_body():
    replica = Replica()
    replica.say(SessionStart(skeleton="kinect_v2"))
    replica.say(still(0))
    replica.say(SessionCalibrate(body="eve"))
    replica.say(still(1))
    (error,) = replica.say(BodyEnd(body="eve"))
    assert (error.code, error.body, error.seq) == ("bad_input", "eve", None)
    assert "was gone before its pose was held" in error.message


def test_more_bodies_than_a_session_may_have_are_not_resumed():
    replica, start = Replica(), SessionStart(checkpoint_s=1.0)
    replica.say(start)
    tokens = tuple(
        next(s for s in replica.say(a_life(1, body=f"b{n}")[0]) if isinstance(s, Checkpoint)).token for n in range(3)
    )
    other = Replica(max_bodies=2)
    (error,) = other.say(start.model_copy(update={"resume": tokens}))
    assert (error.code, error.fatal, other.engine.slots.taken) == ("bad_message", True, 0)


def test_a_drain_leaves_out_no_estimate_of_delivery_latest():
    replica = Replica()
    replica.say(SessionStart(delivery="latest", checkpoint_s=60.0))
    first, *_ = a_life(1)
    ticket, *_ = replica.session.receive(first)
    (snapshot,) = replica.session.checkpoints()
    outcomes = [replica.engine.run([each])[0] for each in (ticket, snapshot)]
    assert kinds(replica.carry(replica.session.conclude(ticket, outcomes[0]))) == ["estimate", "checkpoint"]
    assert kinds(replica.carry(replica.session.conclude(snapshot, outcomes[1]))) == ["checkpoint"]


def test_a_token_is_bound_to_what_a_skeleton_is_and_not_to_its_name():
    spec = {"joints": ("a", "b"), "parents": (-1, 0), "segments": {"pelvis": "a", "thorax": "b"}}
    start = SessionStart(skeleton=SkeletonSpec(name="mine", **spec), checkpoint_s=1.0)
    replica = Replica()
    replica.say(start)
    token = replica.say(still(0, joints=2))[-1].token
    for name, noisy, taken in (("yours", False, True), ("mine", True, False)):
        again = SessionStart(skeleton=SkeletonSpec(name=name, noisy=noisy, **spec), checkpoint_s=1.0, resume=(token,))
        assert isinstance(Replica().say(again)[0], SessionStarted) is taken


@pytest.mark.parametrize("memory", ["staggered", "stateful", "window"])
def test_tokens_are_as_long_as_the_documents_say(memory):
    replica = Replica()
    replica.say(SessionStart(skeleton="kinect_v2", memory=memory, checkpoint_s=1.0, emotion="joy", by_emotion=True))
    said = run(replica, a_life(2, joints=25, count=400))
    longest = max(len(message.token) for message in said if isinstance(message, Checkpoint))
    assert longest <= {"staggered": 12_500, "stateful": 10_500, "window": 40_000}[memory]
