"""A score is the stream's estimates, to the bit, whichever way it was computed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodies import model, motion, terms
from fervor.engine.engine import Engine
from fervor.errors import InputError
from fervor.protocol.messages import Estimate
from fervor.scoring.scorer import MOST_TOGETHER, Scorer, _portions
from fervor.scoring.take import Take
from fervor.scoring.whole import fits
from fervor.session.body import Body, Terms
from fervor.session.events import Pose, Source
from fervor.skeletons.catalog import source
from fervor.skeletons.landmarks import LANDMARKS


def take(frames, *, seed=0, rate=50.0, emotion="joy") -> Take:
    observed = np.random.default_rng(seed).random((frames, 13)) < 0.95
    return Take(f"take {seed}", np.arange(frames) / rate, motion(frames, seed=seed), observed, emotion)


def streamed(item: Take, agreed: Terms) -> list[Estimate]:
    """What a stream of the frames would have got, one by one."""
    engine = Engine(model(), capacity=1)
    body = Body(item.name, engine.claim(), agreed)
    estimates = []
    for seq, time in enumerate(item.times):
        pose = Pose(item.rotations[seq], item.observed[seq])
        ticket = body.plan(seq, float(time), pose, emotion=item.emotion if seq == 0 else None)
        estimates.append(body.conclude(ticket, engine.run([ticket])[0]).to_message())
    return estimates


def check(takes: list[Take], agreed: Terms, *, whole: bool = True) -> None:
    """Score takes together, the fast way or not, and compare with the stream of each."""
    assert {fits(item, agreed) for item in takes} == {whole}
    for item, scored in zip(takes, Scorer(model()).score(takes, agreed), strict=True):
        assert scored.estimates() == streamed(item, agreed)


@pytest.mark.parametrize("changes", [{}, {"by_emotion": True}, {"memory": "stateful"}, {"clock": "frames"}])
@pytest.mark.parametrize("rate", [30.0, 50.0])
def test_a_score_equals_the_stream(changes: dict, rate: float) -> None:
    check([take(frames, seed=frames, rate=rate) for frames in (1, 37, 250, 600)], terms(**changes))


def test_the_window_is_scored_as_the_stream_too() -> None:
    check([take(frames, seed=frames) for frames in (1, 150)], terms(memory="window"), whole=False)


def test_probabilities_that_expire_do_so_in_a_score() -> None:
    check([take(150, emotion={"joy": 0.7, "fear": 0.2})], terms(), whole=False)
    check([take(150, emotion={"joy": 0.7, "fear": 0.2})], terms(emotion_ttl_s=np.inf))


@pytest.mark.parametrize("lost", [0.2, 0.8, 5.0])
def test_gaps_are_those_of_the_stream(lost: float) -> None:
    item = take(300)
    times = item.times + np.where(np.arange(300) >= 100, lost, 0.0) + np.where(np.arange(300) >= 130, lost, 0.0)
    check([Take("gaps", times, item.rotations, item.observed, "joy")], terms(by_emotion=True))


def test_frames_without_a_pose_are_those_of_the_stream() -> None:
    item = take(300)
    for gone in (slice(0, 3), slice(100, 108), slice(100, 140), slice(100, 200), slice(290, 300), slice(0, 300)):
        observed = item.observed.copy()
        observed[gone] = False
        check([Take("lost", item.times, item.rotations, observed, "joy")], terms(by_emotion=True))


def test_joints_that_are_never_or_seldom_seen() -> None:
    item = take(200)
    observed = item.observed & (np.arange(13) != 4)
    observed[50:120, 3:11] = False
    check([Take("hidden", item.times, item.rotations, observed, None)], terms())


@pytest.mark.parametrize("name", ["kinect_v2", "azure_kinect"])
def test_noisy_sensors_flip_as_in_the_stream(name: str) -> None:
    known = source(name)
    random = np.random.default_rng(3)
    rotations = motion(300, joints=len(known.joints))
    for frame in (40, 41, 90, *range(120, 130)):
        rotations[frame, 5:9] = motion(1, seed=int(random.integers(99)), joints=4)[0, :, [1, 2, 3, 0]].T
    observed = random.random(rotations.shape[:2]) < 0.97
    times = np.arange(300) / 30 + np.where(np.arange(300) > 200, 3.0, 0.0)
    agreed = terms(name)
    check([Take("noisy", times, rotations, observed, "anger")], agreed)
    assert any("jump" in estimate.flags for estimate in streamed(Take("", times, rotations, observed), agreed))


@pytest.mark.parametrize("name", sorted(LANDMARKS)[:2])
def test_landmarks_keep_and_forget_their_limbs_as_in_the_stream(name: str) -> None:
    known = LANDMARKS[name]
    points = np.cumsum(np.random.default_rng(1).standard_normal((250, len(known.joints), 3)) * 0.02, axis=0)
    points += np.random.default_rng(2).standard_normal((len(known.joints), 3))
    observed = np.random.default_rng(3).random(points.shape[:2]) < 0.97
    observed[60:65] = False
    times = np.arange(250) / 25 + np.where(np.arange(250) > 150, 2.0, 0.0)
    agreed = Terms(model().metadata, Source(known, "global"))
    check([Take("points", times, points, observed, "joy")], agreed)


def test_times_that_do_not_rise_are_scored_the_plain_way() -> None:
    times = np.arange(200) / 30
    times[50], times[120:] = times[48], times[120:] - 3.0
    check([Take("back", times, motion(200), np.ones((200, 13), np.bool_), "joy")], terms(), whole=False)


@settings(max_examples=30, deadline=None)
@given(
    gaps=st.lists(
        st.sampled_from([1e-7, 1e-6, 0.004, 1 / 120, 1 / 60, 1 / 30, 0.1, 0.25, 0.2500005, 0.4, 1.0, 1.0000005, 1.2]),
        max_size=60,
    ),
    origin=st.sampled_from([0.0, -3.3, 1e6, 1.7e9]),
    memory=st.sampled_from(["staggered", "stateful"]),
    seed=st.integers(0, 9),
)
def test_whatever_the_times(gaps: list[float], origin: float, memory: str, seed: int) -> None:
    times = origin + np.cumsum([0.0, *gaps])
    if (np.diff(times) > 0).all():
        item = take(len(times), seed=seed)
        check([Take("any", times, item.rotations, item.observed, "joy")], terms(memory=memory))


def test_times_without_measure_are_scored_as_the_stream() -> None:
    times = np.array([-1.7e308, -1e300, -1e16, 0.0, 1 / 30, 1e16, 1e16 + 2, 1e300, 1.7e308])
    check([Take("far", times, motion(9), np.ones((9, 13), np.bool_), "joy")], terms())


def test_takes_of_many_steps_are_worked_on_in_portions() -> None:
    slow = [take(150, seed=number, rate=1.0) for number in range(16)]
    together = [scored.estimates() for scored in Scorer(model()).score(slow, terms())]
    assert together[3] == Scorer(model()).score(slow[3:4], terms())[0].estimates()
    assert len(list(_portions(range(16), [150 * 30.0] * 16))) == 2
    assert list(_portions([0, 1, 2], [1e9, 1.0, 1.0])) == [[0], [1, 2]]


def test_company_and_order_change_nothing() -> None:
    takes = [take(20 + number % 5, seed=number) for number in range(MOST_TOGETHER + 10)]
    scorer = Scorer(model())
    together = [scored.estimates() for scored in scorer.score(takes, terms())]
    assert together == [scored.estimates() for scored in scorer.score(takes[::-1], terms())[::-1]]
    assert together[7] == scorer.score(takes[7:8], terms())[0].estimates()


def test_rows_padded_to_a_multiple_say_the_same() -> None:
    takes = [take(frames, seed=frames) for frames in (1, 37, 250, 600)]
    done: list[int] = []
    padded = Scorer(model(), row_multiple=4).score(takes, terms(), progress=done.append)
    assert sum(done) == 888
    assert [scored.estimates() for scored in padded] == [
        scored.estimates() for scored in Scorer(model()).score(takes, terms())
    ]


@pytest.mark.parametrize("memory", ["staggered", "window"])
def test_progress_counts_every_frame(memory: str) -> None:
    done: list[int] = []
    Scorer(model()).score([take(30), take(10), take(0)], terms(memory=memory), progress=done.append)
    assert sum(done) == 40
    assert min(done) > 0


def test_a_long_take_is_told_of_on_its_way() -> None:
    done: list[int] = []
    Scorer(model()).score([take(3000)], terms(), progress=done.append)
    assert sum(done) == 3000
    assert len(done) > 2


@pytest.mark.parametrize("memory", ["staggered", "window"])
def test_an_unknown_emotion_is_told_and_costs_nothing(memory: str) -> None:
    scorer = Scorer(model())
    with pytest.raises(InputError, match="'joie'"):
        scorer.score([take(3, emotion="joie")], terms(memory=memory))
    assert scorer.score([take(3)], terms(memory=memory))


def test_nothing_to_score() -> None:
    assert Scorer(model()).score([], terms()) == []
    (scored,) = Scorer(model()).score([take(0)], terms())
    assert scored.estimates() == []
