"""A stream that is cut goes on as if nothing had happened: the client's core and real sessions, back to back.

Messages wait between the two in both directions, and a cut loses those that wait. The service after a cut is another
one, with an engine of its own and the same key.
"""

import random
from collections import Counter, deque
from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import fervor_client.resuming as module
from bodies import host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import CheckpointUnknown, FervorError, Unreachable
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import Estimate, SessionCalibrate
from fervor.session.events import Close, Release, Reply, Restore, Ticket
from fervor.session.sealing import Sealer
from fervor.session.session import Session
from fervor.skeletons.rig import SEGMENTS
from fervor_client import SkeletonSpec
from fervor_client.conversation import Conversation
from fervor_client.options import Options, opening
from fervor_client.retrying import Reconnect, Retries

CODEC = CODECS["fervor.v1.json"]
KEY = Sealer((b"key",), 300.0)
OTHER = Sealer((b"another",), 300.0)
POSES = motion(400)
HELD = np.tile([0.5, 0.5, 0.5, 0.5], (14, 1))
STRANGE = SkeletonSpec(
    name="strange", joints=SEGMENTS, parents=(-1,) * 14, segments={n: n for n in SEGMENTS}, axes="global"
)


class Service:
    """A replica, and one session on it. Work waits until it is asked to do some."""

    def __init__(self, sealer: Sealer | None = KEY, now: float = 0.0) -> None:
        self.engine = Engine(model(), capacity=8)
        base = host(self.engine.claim, max_bodies=4)
        if sealer is not None:
            base = replace(base, seal=lambda data: sealer.seal(data, now), unseal=lambda token: sealer.open(token, now))
        self.session = Session("s", base)
        self.heard: deque[str | bytes] = deque()
        self.said: deque[str | bytes] = deque()
        self.work: deque[Ticket | Release | Restore] = deque()

    def listen(self) -> None:
        if self.heard:
            self._carry(self.session.receive(CODEC.decode_client(self.heard.popleft())))

    def toil(self) -> None:
        if not self.work:
            return
        match self.work.popleft():
            case Ticket() as ticket:
                self._carry(self.session.conclude(ticket, self.engine.run([ticket])[0]))
            case Restore(slot, memory):
                self.engine.restore(slot, memory)
            case Release(slot):
                self.engine.release(slot)

    def leave(self) -> None:
        """SIGTERM: all answered, and a last checkpoint each."""
        self._carry(self.session.checkpoints())
        while self.work:
            self.toil()

    def _carry(self, events) -> None:
        for event in events:
            if isinstance(event, Reply):
                self.said.append(CODEC.encode(event.message))
            elif not isinstance(event, Close):
                self.work.append(event)


class Robot:
    """A client, and the services it meets."""

    def __init__(self, services=Service, *, retry_for: float | None = None, start=None, **options) -> None:
        self.now = 0.0
        self.errors: list[FervorError] = []
        self.reconnects: list[Reconnect] = []
        self.asked: list[int] = []  # calibrations
        self.services = services
        retries = Retries(retry_for, now=lambda: self.now, dice=lambda: 0.5)
        asked = start or opening("c13", "joy", Options(**{"checkpoint_s": 0.5, **options}), resume=True)
        self.conversation = Conversation(asked, url="ws://x", retries=retries, now=lambda: self.now)
        self.dial()
        self.settle()

    def dial(self) -> None:
        self.service = self.services()
        self.service.heard.append(self.conversation.start())

    def step(self, what: str) -> None:
        """One of the things that happen by themselves, in whatever order."""
        if what == "send" and (payload := self.conversation.next_payload()) is not None:
            self.service.heard.append(payload)
        elif what == "listen":
            self.service.listen()
        elif what == "toil":
            self.service.toil()
        elif what == "hear" and self.service.said:
            self.note(self.conversation.receive(self.service.said.popleft()))
            if not self.conversation.linked and not self.conversation.linking:
                self.cut()  # the service hung up
        self.now += self.conversation.pause_s

    def calibrate(self, request: SessionCalibrate) -> None:
        self.asked.append(self.conversation.calibrate(request))

    def note(self, news) -> None:
        for item in news:
            (self.reconnects if isinstance(item, Reconnect) else self.errors).append(item)

    def cut(self) -> None:
        plan = self.conversation.interrupted(Unreachable("cut"))
        if plan is not None:
            self.note([plan])
            self.now += plan.delay_s
            self.dial()

    def settle(self) -> None:
        """Until nothing moves any more."""
        while True:
            for what in ("send", "listen", "toil", "hear"):
                self.step(what)
            service = self.service
            if not (service.heard or service.work or service.said or self.conversation.pause_s):
                payload = self.conversation.next_payload()
                if payload is None:
                    return
                service.heard.append(payload)

    def read(self) -> list[Estimate]:
        return list(iter(self.conversation.next_estimate, None))

    def by_body(self) -> dict[str, list[Estimate]]:
        told: dict[str, list[Estimate]] = {}
        for estimate in self.read():
            told.setdefault(estimate.body, []).append(estimate)
        return told


BODIES = ("ann", "bob", "cyd")


def a_script(seed: int, count: int = 160) -> list[tuple]:
    """What a caller does: people come, go and come back; labels change; frames are late, empty or wrong."""
    dice = random.Random(seed)
    time, script = 0.0, []
    names, seen = list(BODIES), {}
    for number in range(count):
        time += dice.choice([0.01] * 4 + [0.033] * 20 + [0.3, 0.7, 1.4])
        if dice.random() < 0.015:
            time += 12.0  # longer than a body is remembered
            names = dice.sample(BODIES, dice.randint(1, 3))
        if dice.random() < 0.03:
            names = dice.sample(BODIES, dice.randint(1, 3))
        body, chance = dice.choice(names), dice.random()
        if chance < 0.02:
            script.append(("reset_body", body))
        elif chance < 0.04:
            script.append(("end_body", body))
            seen.pop(body, None)
        else:
            about = time - seen.get(body, -99.0) < 5.0
            script.append(("frame", body, number, time, *_extras(dice, number, about=about)))
            seen[body] = time
    return script


def a_script_with_a_calibration(seed: int) -> list[tuple]:
    """The same of the strange sensor; Ann stands still and, once, is asked to."""
    script = [_strange(act) if act[0] == "frame" else act for act in a_script(seed)]
    script.insert(random.Random(seed).randrange(len(script)), ("calibrate", SessionCalibrate(body="ann", seconds=0.2)))
    return script


def a_script_with_calibrations(seed: int) -> list[tuple]:
    """Everybody stands still, and some are asked to, one soon after another."""
    dice = random.Random(seed)
    script = [_strange(act, BODIES) if act[0] == "frame" else act for act in a_script(seed)]
    place = dice.randrange(len(script))
    for _ in range(dice.randint(2, 4)):
        request = SessionCalibrate(body=dice.choice(BODIES), seconds=dice.choice([0.2, 0.5]))
        script.insert(place, ("calibrate", request))
        place = min(place + dice.choice([1, 3, 10, 30]), len(script))
    return script


def a_script_of_labels(seed: int) -> list[tuple]:
    """Every frame has a pose and is a step at least, so that its label is in force with it, however much was lost.

    Probabilities expire, and count from when they are repeated, so there are none; and what is refused brings no label
    to frames that were sent before that is known.
    """
    script = []
    for act in a_script(seed):
        if act[0] == "frame":
            kind, body, number, time, _, label, _ = act
            label = label if label in ("joy", "fear", "unknown") else None  # others can't be hashed
            act = kind, body, number, 4 * time, POSES[number % len(POSES)], label, None  # noqa: PLW2901
        script.append(act)
    return script


def _strange(act: tuple, still: Collection[str] = ("ann",)) -> tuple:
    kind, body, number, time, pose, *rest = act
    turns = np.vstack([pose, pose[:1]])  # [segment, 4]
    return kind, body, number, time, HELD if body in still and np.abs(turns).max() <= 1.0 else turns, *rest


def _extras(dice: random.Random, number: int, *, about: bool) -> tuple:
    """A pose, and sometimes a label or a seq of the caller's. Only of a body that is about, something is wrong."""
    pose = POSES[number % len(POSES)].copy()
    chance, label, seq = dice.random(), None, None
    if chance < 0.02 and about:
        pose *= 9.0  # refused
    elif chance < 0.05:
        pose[:] = np.nan
    elif chance < 0.1:
        label = dice.choice(["joy", "fear", {"fear": 0.6, "joy": 0.3}, "unknown", "ennui" if about else "fear"])
    elif chance < 0.12:
        seq = max(number - 40, 0) * 1000 + 1 + number  # between those the client gives, so mostly late
    return pose, label, seq


def perform(robot: Robot, act: tuple) -> None:
    if act[0] == "calibrate":
        robot.calibrate(act[1])
        return
    if act[0] != "frame":
        getattr(robot.conversation, act[0])(act[1])
        return
    _, body, number, time, pose, label, seq = act
    robot.conversation.frame(pose, body=body, seq=number * 1000 if seq is None else seq, t=time, emotion=label)


def run_whole(script, **options) -> Robot:
    robot = Robot(**options)
    for act in script:
        perform(robot, act)
        robot.settle()
    robot.conversation.end()
    robot.settle()
    assert robot.conversation.over
    return robot


def run_cut(script, dice: random.Random, *, cuts: float, **options) -> Robot:
    """The same, with everything in random order, and cuts at any place."""
    robot = Robot(**options)
    waiting = deque(script)
    while waiting or robot.conversation.in_flight:
        if waiting and robot.conversation.in_flight < 20 and dice.random() < 0.4:
            perform(robot, waiting.popleft())
        robot.step(dice.choice(("send", "listen", "toil", "hear")))
        if dice.random() < cuts:
            if dice.random() < 0.2:
                robot.service.leave()
                for _ in range(dice.randint(0, len(robot.service.said))):
                    robot.step("hear")
            robot.cut()
    robot.conversation.end()
    robot.step("send")
    if dice.random() < 0.5:
        robot.cut()
    robot.settle()
    assert robot.conversation.over
    return robot


@pytest.mark.parametrize("memory", ["staggered", "window"])
@settings(max_examples=12, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(seed=st.integers(0, 10_000), luck=st.integers(0, 10_000), cuts=st.sampled_from([0.003, 0.01, 0.03]))
def test_a_stream_that_is_cut_equals_a_whole_one_to_the_bit(memory, seed, luck, cuts):
    script = a_script(seed)
    whole = run_whole(script, memory=memory)
    torn = run_cut(script, random.Random(luck), cuts=cuts, memory=memory)
    assert torn.by_body() == whole.by_body()
    told = [str(error) for error in whole.errors if "not known in this session" not in str(error)]
    assert [str(error) for error in torn.errors if "not known in this session" not in str(error)] == told
    assert torn.conversation.totals.estimates == whole.conversation.totals.estimates
    assert all(news.exact and not news.anew for news in torn.reconnects)


@settings(max_examples=8, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(seed=st.integers(0, 10_000), luck=st.integers(0, 10_000), cuts=st.sampled_from([0.01, 0.03, 0.1]))
def test_a_stream_that_is_calibrated_and_cut_equals_a_whole_one_to_the_bit(seed, luck, cuts):
    script, start = a_script_with_a_calibration(seed), opening(STRANGE, "joy", Options(checkpoint_s=0.5), resume=True)
    whole = run_whole(script, start=start)
    torn = run_cut(script, random.Random(luck), cuts=cuts, start=start)
    assert torn.by_body() == whole.by_body()
    assert torn.conversation.totals.estimates == whole.conversation.totals.estimates
    assert all(news.exact and not news.anew for news in torn.reconnects)


@settings(max_examples=8, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate])
@given(seed=st.integers(0, 10_000), luck=st.integers(0, 10_000), cuts=st.sampled_from([0.01, 0.03, 0.1]))
def test_several_calibrations_at_once_that_are_cut_come_to_the_same(seed, luck, cuts):
    """Ann, Bob and Cyd hold still, one is asked before another was answered: in the end the same holds as uncut."""
    script, start = a_script_with_calibrations(seed), opening(STRANGE, "joy", Options(checkpoint_s=0.5), resume=True)
    whole = run_whole(script, start=start)
    torn = run_cut(script, random.Random(luck), cuts=cuts, start=start)
    assert torn.by_body() == whole.by_body()
    assert all(news.exact and not news.anew for news in torn.reconnects)
    assert calibrated(torn) == calibrated(whole)


@settings(max_examples=8, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate])
@given(seed=st.integers(0, 10_000), luck=st.integers(0, 10_000), cuts=st.sampled_from([0.01, 0.03, 0.1]))
def test_bodies_that_services_lose_keep_their_labels_and_nothing_of_lives_that_ended(seed, luck, cuts):
    """About every other service has another key: what it can't go on with begins anew, and no more than that."""
    dice, script = random.Random(luck), a_script_of_labels(seed)
    whole = run_whole(script)
    torn = run_cut(script, dice, cuts=cuts, services=lambda: Service(dice.choice([KEY, OTHER])))
    told, expected = torn.by_body(), whole.by_body()
    assert {body: named(told[body]) for body in told} == {body: named(expected[body]) for body in expected}
    refused, uncut = Counter(map(str, torn.errors)), Counter(map(str, whole.errors))
    assert refused <= uncut, "nothing is told of bodies that are lost"
    assert all("not known in this session" in error for error in uncut - refused)


def named(estimates: list[Estimate]) -> list[tuple[int, str]]:
    """Frames and the labels in force there."""
    return [(estimate.seq, estimate.emotion) for estimate in estimates]


def calibrated(robot: Robot) -> list[str]:
    """What the calibrations came to."""
    found = []
    for number in robot.asked:
        try:
            found.append(str(robot.conversation.take_calibration(number)))
        except FervorError as error:
            found.append(str(error))
    return found


def test_what_was_counted_is_counted_once_across_cuts():
    script = [act for act in a_script(5) if act[0] == "frame"]
    whole, torn = run_whole(script), run_cut(script, random.Random(1), cuts=0.02)
    assert torn.conversation.reconnects == sum(news.delay_s is None for news in torn.reconnects) > 3
    assert torn.conversation.totals == whole.conversation.totals


def frames(robot: Robot, numbers, *, body: str = "ann", rate: float = 30.0, **fields) -> None:
    for number in numbers:
        robot.conversation.frame(POSES[number], body=body, t=number / rate, **fields)
        robot.settle()


@pytest.mark.parametrize("sealers", [(KEY, Sealer((b"another",), 300.0)), (None, None)])
def test_a_service_with_another_key_begins_anew_and_says_so(sealers, monkeypatch):
    """4404, or a service that gives no checkpoints at all and is asked after more frames than are kept."""
    monkeypatch.setattr(module, "MOST_KEPT", 20)
    made = iter([sealers[0], *[sealers[1]] * 9])
    robot = Robot(services=lambda: Service(next(made)), checkpoint_s=0.3)
    frames(robot, range(39), emotion="fear")
    robot.conversation.frame(POSES[39], body="ann", t=39 / 30)
    robot.cut()
    robot.settle()
    told = robot.read()
    assert [estimate.seq for estimate in told] == list(range(40))
    assert (told[-1].flags, told[-1].emotion, told[-1].status) == (("reset",), "fear", "warming_up")
    assert robot.reconnects[-1].anew == ("ann",)
    assert robot.reconnects[-1].delay_s is None
    if sealers[0] is not None:
        assert isinstance(robot.reconnects[-1].reason, CheckpointUnknown)
    robot.cut()
    robot.settle()
    frames(robot, [40])
    (last,) = robot.read()
    assert (last.flags, last.emotion) == ((), "fear")  # what began anew is resumed like any other


def test_a_body_that_is_lost_while_nothing_is_under_way_keeps_its_label():
    made = iter([KEY, *[Sealer((b"another",), 300.0)] * 9])
    robot = Robot(services=lambda: Service(next(made)))
    frames(robot, range(5), emotion="fear")
    robot.cut()
    robot.settle()
    frames(robot, [5, 6])
    told = robot.read()
    assert ["reset" in estimate.flags for estimate in told[5:]] == [True, False]
    assert {estimate.emotion for estimate in told} == {"fear"}


def services_that_lose() -> Iterator[Service]:
    yield Service()
    while True:
        yield Service(OTHER)


def test_a_lost_body_is_told_its_label_again_where_the_frame_that_brought_it_was_refused():
    made = services_that_lose()
    robot = Robot(lambda: next(made))
    frames(robot, range(5), emotion="fear")
    robot.cut()
    robot.settle()
    robot.conversation.frame(POSES[5] * 9.0, body="ann", t=5 / 30)
    robot.settle()
    assert [str(error)[:13] for error in robot.errors] == ["frame 5 of bo"]
    frames(robot, [6, 7])
    assert named(robot.read())[5:] == [(6, "fear"), (7, "fear")]


def test_no_old_label_takes_the_place_of_a_new_one_that_is_under_way():
    made = services_that_lose()
    robot = Robot(lambda: next(made))
    frames(robot, range(5), emotion="fear")
    robot.cut()
    robot.settle()
    robot.conversation.frame(POSES[5] * 9.0, body="ann", t=5 / 30)
    robot.conversation.frame(POSES[6], body="ann", t=6 / 30, emotion="pride")
    while not robot.errors:
        for what in ("send", "listen", "hear"):
            robot.step(what)
    frames(robot, [7])
    assert named(robot.read())[5:] == [(6, "pride"), (7, "pride")]


def test_a_lost_body_that_ends_and_comes_back_is_a_new_one():
    """The service has forgotten it already: it is told of no end, and nothing of before is told of the new life."""
    made = services_that_lose()
    robot = Robot(lambda: next(made))
    frames(robot, range(5), emotion="fear")
    robot.cut()
    robot.settle()
    assert robot.reconnects[-1].anew == ("ann",)
    robot.conversation.reset_body("ann")
    robot.conversation.end_body("ann")
    frames(robot, [5, 6])
    assert [(estimate.seq, estimate.emotion, estimate.flags) for estimate in robot.read()[5:]] == [
        (5, "joy", ()),
        (6, "joy", ()),
    ]
    assert robot.errors == []
    robot.conversation.end_body("bob")
    robot.settle()
    assert "not known in this session" in str(robot.errors[0]), "of a body that never was that is told"


def test_a_lost_body_that_comes_back_after_long_is_a_new_one():
    made = services_that_lose()
    robot = Robot(lambda: next(made))
    frames(robot, range(5), emotion="fear")
    robot.cut()
    robot.settle()
    robot.conversation.frame(POSES[5], body="ann", t=30.0)
    robot.settle()
    assert named(robot.read())[5:] == [(5, "joy")]


def test_a_checkpoint_that_grew_old_does_not_cost_the_others_theirs():
    """Bob left long ago, and the service takes his checkpoint no more; ann goes on to the bit."""
    clock = [0.0]
    whole = Robot(checkpoint_s=0.3)
    frames(whole, [0], body="bob")
    frames(whole, range(400))
    robot = Robot(services=lambda: Service(Sealer((b"key",), 300.0), clock[0]), checkpoint_s=0.3)
    frames(robot, [0], body="bob")
    robot.now += 400.0
    clock[0] = 400.0
    issuer = robot.service.session._following._issuer
    issuer._host = replace(issuer._host, seal=lambda data: KEY.seal(data, 400.0))
    frames(robot, range(390))
    robot.cut()
    robot.settle()
    frames(robot, range(390, 400))
    assert robot.reconnects[-1].anew == ("bob",)
    assert robot.by_body() == whole.by_body()


def test_a_service_that_gives_no_checkpoints_is_told_everything_again_while_it_fits():
    script = [act for act in a_script(7, count=90) if act[0] == "frame"]
    whole = run_whole(script)
    torn = run_cut(script, random.Random(3), cuts=0.02, services=lambda: Service(None))
    assert torn.by_body() == whole.by_body()
    assert torn.conversation.reconnects > 3


def test_a_calibrated_session_resumes_under_its_new_alignment():
    start = opening(STRANGE, "joy", Options(checkpoint_s=0.3), resume=True)

    def life(cuts: set[int]) -> Robot:
        robot = Robot(start=start)
        for number in range(90):
            if number == 10:
                robot.calibrate(SessionCalibrate(body="ann", seconds=0.5, name="lab"))
            robot.conversation.frame(HELD, body="ann", t=number / 30)
            if number in cuts:
                robot.cut()
            robot.settle()
        return robot

    whole, torn = life(set()), life({5, 16, 60, 75})
    found = calibrated(whole)
    assert "lab" in found[0]
    assert calibrated(torn) == found
    assert torn.by_body() == whole.by_body()
    assert [news.anew for news in torn.reconnects if news.delay_s is None] == [()] * 4


def test_a_cut_after_any_message_around_a_calibration_changes_nothing():
    """Bob's frames around it have numbers from before: a service that had lost him would not find them late."""
    start = opening(STRANGE, "joy", Options(checkpoint_s=60.0), resume=True)

    def life(cut_after: int | None) -> tuple[Robot, int]:
        robot, heard = Robot(start=start), 0
        for number in range(16):
            if number == 4:
                robot.calibrate(SessionCalibrate(body="ann", seconds=0.2))
            body = "bob" if number % 4 == 0 else "ann"
            label = "fear" if number in (0, 5) else None
            seq = {8: 35, 12: 30}.get(number, number * 10)
            robot.conversation.frame(HELD, body=body, seq=seq, t=number / 25, emotion=label)
            for what in ("send", "send", "listen", "listen", "toil", "toil"):
                robot.step(what)
            while robot.service.said:
                robot.step("hear")
                heard += 1
                if heard == cut_after:
                    robot.cut()
        robot.settle()
        return robot, heard

    whole, messages = life(None)
    told, found = whole.by_body(), calibrated(whole)
    assert [estimate.flags for estimate in told["bob"][2:]] == [("late",), ("late",)]
    for number in range(1, messages + 1):
        torn, _ = life(number)
        assert torn.by_body() == told, f"cut after message {number} of {messages}"
        assert torn.reconnects[-1].anew == ()
        assert calibrated(torn) == found


def test_a_checkpoint_may_pass_over_a_life_that_a_calibration_keeps_from_being_forgotten():
    """Ann comes back before her pose is asked for, so that her new life has a checkpoint; then Bob is asked instead."""

    def life(*, cut: bool) -> list[Estimate]:
        robot = Robot(start=opening(STRANGE, "joy", Options(checkpoint_s=60.0), resume=True))
        robot.conversation.frame(HELD, body="ann", t=0.0)
        robot.conversation.end_body("ann")
        robot.conversation.frame(HELD, body="ann", t=0.1)
        robot.calibrate(SessionCalibrate(body="ann"))
        robot.settle()
        robot.calibrate(SessionCalibrate(body="bob"))
        if cut:
            robot.cut()
        robot.conversation.frame(HELD, body="ann", t=0.2)
        robot.settle()
        assert robot.conversation.reconnects == cut
        return robot.read()

    assert life(cut=True) == life(cut=False)


def test_a_label_given_while_a_calibration_waited_outlives_the_checkpoint():
    """Ann leaves before her pose is held and comes back: what she brings then is not forgotten with her first life."""
    made = iter([KEY, *[Sealer((b"another",), 300.0)] * 9])
    robot = Robot(lambda: Service(next(made)), start=opening(STRANGE, "joy", Options(), resume=True))
    for number in range(10):
        label = "fear" if number == 1 else None
        robot.conversation.frame(HELD, body="ann", t=number / 30, emotion=label)
        robot.settle()
        if number == 0:
            robot.calibrate(SessionCalibrate(body="ann", seconds=0.2))
            robot.conversation.end_body("ann")
    assert "strange" in calibrated(robot)[0]
    robot.cut()
    robot.settle()
    robot.conversation.frame(HELD, body="ann", t=1 / 3)
    robot.settle()
    last = robot.read()[-1]
    assert (last.seq, last.flags, last.emotion) == (10, ("reset",), "fear")


def test_a_body_that_ends_while_a_resume_is_under_way_is_a_new_one_after_it():
    def life(*, cut: bool) -> list[Estimate]:
        robot = Robot(checkpoint_s=0.3)
        frames(robot, range(20))
        if cut:
            robot.cut()  # the new service has been told the checkpoint, and not yet answered
        robot.conversation.end_body("ann")
        frames(robot, range(20, 30))
        assert robot.conversation.reconnects == cut
        return robot.read()

    assert life(cut=True) == life(cut=False)


def test_a_checkpoint_after_a_calibration_counts_though_it_names_the_frame_of_the_one_before():
    start = opening(STRANGE, "joy", Options(checkpoint_s=60.0), resume=True)

    def life(*, cut: bool) -> dict[str, list[Estimate]]:
        robot = Robot(start=start)
        robot.conversation.frame(HELD, body="bob", t=0.0)  # with a checkpoint
        robot.settle()
        robot.calibrate(SessionCalibrate(body="ann", seconds=0.5))
        for number in range(20):
            robot.conversation.frame(HELD, body="ann", t=number / 30)
        robot.settle()
        if cut:
            robot.cut()
            robot.settle()
            assert robot.reconnects[-1].anew == ()
        robot.conversation.frame(HELD, body="bob", t=0.7)
        robot.settle()
        return robot.by_body()

    assert life(cut=True) == life(cut=False)


def test_delivery_latest_gives_rising_numbers_and_the_newest():
    robot = Robot(delivery="latest")
    dice = random.Random(2)
    for number in range(200):
        robot.conversation.frame(POSES[number], body="ann", t=number / 30)
        for _ in range(dice.randint(0, 8)):
            robot.step(dice.choice(("send", "listen", "toil", "hear")))
        if dice.random() < 0.05:
            robot.cut()
    robot.settle()
    seqs = [estimate.seq for estimate in robot.read()]
    assert seqs == sorted(set(seqs))
    assert seqs[-1] == 199
    assert robot.conversation.in_flight == 0


def test_after_a_drain_nothing_has_to_be_sent_again():
    robot = Robot(checkpoint_s=60.0)
    frames(robot, range(30))
    robot.service.leave()
    robot.settle()
    robot.cut()
    assert len(robot.service.heard) == 1
    robot.settle()
    assert robot.reconnects[-1].delay_s is None
    assert robot.conversation.next_payload() is None


def test_a_backlog_leaves_no_faster_than_the_service_takes_it():
    robot = Robot(checkpoint_s=60.0)
    for number in range(300):
        robot.conversation.frame(POSES[number], body="ann", t=number / 30)
    slow = Service()
    slow.session._host = replace(
        slow.session._host, limits=slow.session._host.limits.model_copy(update={"max_frames_per_second": 50.0})
    )
    robot.services = lambda: slow
    robot.cut()
    for what in ("listen", "hear"):
        robot.step(what)
    before, sent = robot.now, 0
    while robot.conversation.next_payload() is not None:
        sent += 1
        robot.now += robot.conversation.pause_s
    assert sent == 300
    assert robot.now - before == pytest.approx((300 - 25) / 47.5, rel=0.05)


def test_a_fatal_refusal_ends_the_stream_with_its_own_error():
    robot = Robot()
    frames(robot, range(3))
    robot.service.said.append('{"type":"error","code":"rate_exceeded","message":"too fast","fatal":true}')
    robot.step("hear")
    assert robot.conversation.over
    assert str(robot.conversation.failure) == "too fast"


def test_a_goodbye_that_is_cut_off_needs_no_new_connection():
    robot = Robot()
    frames(robot, range(3))
    robot.conversation.end()
    robot.cut()
    assert robot.conversation.over
    assert robot.conversation.failure is None
    assert robot.conversation.totals.frames == 3


def test_giving_up_says_for_how_long_it_was_tried():
    robot = Robot(retry_for=60.0)
    frames(robot, range(3))
    robot.conversation.frame(POSES[3], body="ann", t=0.1)
    while (plan := robot.conversation.interrupted(Unreachable("nobody answers"))) is not None:
        robot.now += plan.delay_s
    assert robot.now == pytest.approx(60.0)
    with pytest.raises(Unreachable, match=r"^nobody answers; tried to reconnect \d+ times in 60 s"):
        robot.conversation.must_be_open()
    assert [robot.conversation.next_estimate().seq for _ in range(3)] == [0, 1, 2]
    with pytest.raises(Unreachable, match="tried to reconnect"):
        robot.conversation.next_estimate()
