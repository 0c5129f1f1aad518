"""A score is the stream's estimates, to the bit."""

import numpy as np
import pytest

from bodies import model, motion, terms
from fervor.engine.engine import Engine
from fervor.errors import InputError
from fervor.scoring import MOST_TOGETHER, Scorer, Take, summarise
from fervor.session.body import Body
from fervor.session.events import Pose


def take(frames, *, seed=0, rate=50.0, emotion="joy") -> Take:
    observed = np.random.default_rng(seed).random((frames, 13)) < 0.95
    return Take(f"take {seed}", np.arange(frames) / rate, motion(frames, seed=seed), observed, emotion)


def streamed(item: Take):
    engine = Engine(model(), capacity=1)
    body = Body(item.name, engine.claim(), terms())
    estimates = []
    for seq, time in enumerate(item.times):
        pose = Pose(item.rotations[seq], item.observed[seq])
        ticket = body.plan(seq, float(time), pose, emotion=item.emotion if seq == 0 else None)
        estimates.append(body.conclude(ticket, engine.run([ticket])[0]))
    return estimates


def test_a_score_equals_the_stream():
    takes = [take(frames, seed=frames) for frames in (1, 37, 250, 600)]
    for item, scored in zip(takes, Scorer(model()).score(takes, terms()), strict=True):
        assert [e.model_dump(exclude={"body"}) for e in scored] == [
            e.model_dump(exclude={"body"}) for e in streamed(item)
        ]


def test_company_and_order_change_nothing():
    takes = [take(20 + number % 5, seed=number) for number in range(MOST_TOGETHER + 10)]
    scorer = Scorer(model())
    together = scorer.score(takes, terms())
    assert together == scorer.score(takes[::-1], terms())[::-1]
    assert together[7] == scorer.score(takes[7:8], terms())[0]


def test_progress_counts_every_frame():
    done = []
    Scorer(model()).score([take(30), take(10)], terms(), progress=done.append)
    assert sum(done) == 40


def test_an_unknown_emotion_is_told_and_costs_no_slot():
    scorer = Scorer(model())
    for _ in range(MOST_TOGETHER + 1):
        with pytest.raises(InputError, match="'joie'"):
            scorer.score([take(3, emotion="joie")], terms())
    assert scorer.score([take(3)], terms())


def test_nothing_to_score():
    assert Scorer(model()).score([], terms()) == []
    assert Scorer(model()).score([take(0)], terms()) == [[]]


def test_summary():
    item = take(200, rate=50.0)
    (estimates,) = Scorer(model()).score([item], terms())
    summary = summarise(item.name, estimates)
    settled = [e.intensity for e in estimates if e.status == "ok"]
    assert (summary.frames, summary.emotion, summary.duration_s) == (200, "joy", pytest.approx(3.98))
    assert summary.mean == pytest.approx(np.mean(settled))
    assert summary.peak == max(settled)
    assert summary.last == estimates[-1].intensity
    assert summary.level == estimates[-1].level
    empty = summarise("x", [])
    assert (empty.mean, empty.frames) == (None, 0)
