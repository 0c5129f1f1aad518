"""Checkpoints are given where they are due, and under the agreement that they were taken under."""

from dataclasses import replace

import numpy as np
import pytest

from bodies import host, model, motion
from fervor.engine.engine import Engine
from fervor.errors import CheckpointMismatch, EngineError
from fervor.protocol.messages import SessionStart
from fervor.session.body import Body
from fervor.session.events import Pose
from fervor.session.issuer import Issuer
from fervor.session.roster import Roster
from fervor.session.start import agree

POSE = Pose(motion(1)[0], np.ones(13, np.bool_))


@pytest.fixture
def engine() -> Engine:
    return Engine(model(), capacity=4)


def service(engine):
    return replace(host(engine.claim), seal=bytes.hex, unseal=bytes.fromhex)


def agreement(**start):
    return agree(SessionStart(checkpoint_s=1.0, **start), model().metadata)


def concluded(engine, agreed):
    """A body with its first frame, with which a checkpoint is due."""
    body = Body("eve", engine.claim(), agreed.terms)
    ticket = body.plan(7, 0.0, POSE)
    (outcome,) = engine.run([ticket])
    body.conclude(ticket, outcome)
    return body, ticket, outcome


def test_a_body_goes_on_from_what_was_issued(engine):
    agreed = agreement()
    issuer = Issuer(service(engine), agreed)
    checkpoint = issuer.issue(*[concluded(engine, agreed)[at] for at in (1, 0, 2)])
    assert (checkpoint.body, checkpoint.seq) == ("eve", 7)
    roster = Roster(engine.claim, most=4, idle_s=10.0)
    (resumed,), (restore,) = Issuer(service(engine), agreed).resume((checkpoint.token,), roster)
    assert (resumed.body, resumed.seq, resumed.same_runtime) == ("eve", 7, True)
    assert roster.known("eve").slot == restore.slot
    with pytest.raises(CheckpointMismatch, match="other terms"):
        Issuer(service(engine), agreement(memory="stateful")).resume((checkpoint.token,), roster)


def test_none_is_issued_where_none_is_due_or_can_be(engine):
    agreed = agreement()
    body, ticket, outcome = concluded(engine, agreed)
    issuer = Issuer(service(engine), agreed)
    assert issuer.issue(ticket, body, EngineError("no")) is None
    assert issuer.issue(body.plan(8, 0.1, POSE), body, outcome) is None
    assert Issuer(host(engine.claim), agreed).issue(ticket, body, outcome) is None  # a service that gives none
    other = agreement(skeleton="kinect_v2")
    assert Issuer(service(engine), other).issue(ticket, body, outcome) is None  # calibrated since
