"""Answers wait for the last of their message."""

from fervor.protocol.lean_estimate import LeanEstimate
from fervor.protocol.messages import Checkpoint, SessionCalibrated
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.session.groups import Gathered, Groups


def estimate(seq: int) -> LeanEstimate:
    return LeanEstimate(body="0", seq=seq, t=0.0, intensity=0.5, level="weak", emotion="joy", status="ok")


def test_answers_come_together_in_the_order_of_their_frames():
    groups = Groups()
    group = groups.open()
    for _ in range(2):
        groups.expect(group)
    groups.put(group, 1, estimate(8))
    assert groups.close(group) is None
    groups.put(group, 0, estimate(7))
    assert groups.close(group) is None
    gathered = groups.close(group)
    assert gathered is not None
    assert [answer.seq for answer in gathered.estimates] == [7, 8]


def test_a_message_without_frames_under_way_ends_at_once():
    groups = Groups()
    assert groups.close(groups.open()) == Gathered((), ())


def test_messages_do_not_mix():
    groups = Groups()
    first, second = groups.open(), groups.open()
    groups.put(second, 0, estimate(1))
    assert groups.close(first) == Gathered((), ())
    assert groups.close(second) == Gathered((estimate(1),), ())


def test_checkpoints_follow_the_answers_and_the_newest_of_a_body_is_enough():
    groups = Groups()
    group = groups.open()
    for seq, body in ((1, "a"), (2, "b"), (3, "a")):
        groups.follow(group, Checkpoint(body=body, seq=seq, token="x"))
    gathered = groups.close(group)
    assert gathered is not None
    assert [(message.body, message.seq) for message in gathered.followers] == [("b", 2), ("a", 3)]


def test_a_calibration_takes_the_checkpoints_that_come_with_it_into_its_message():
    groups = Groups()
    group = groups.open()
    skeleton = SkeletonSpec(name="one", joints=("a",), parents=(-1,), segments={})
    calibrated = SessionCalibrated(skeleton=skeleton, frames=1, spread_deg=0.0, unseen=())
    checkpoints = tuple(Checkpoint(body=body, seq=1, token="x") for body in ("a", "b"))
    for message in (calibrated, *checkpoints):
        groups.follow(group, message)
    gathered = groups.close(group)
    assert gathered is not None
    assert gathered.followers == (calibrated.model_copy(update={"checkpoints": checkpoints}),)
