"""Calibration inside a live session: collected by times, adopted, handed back, used again."""

import numpy as np
from scipy.spatial.transform import Rotation

from fervor.protocol.messages import Error, Estimate, Frame, SessionCalibrate, SessionCalibrated, SessionStart
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.skeletons.rig import SEGMENTS
from test_session_session import Talk
from test_skeletons_calibration import held, rendered, sensor

ODD = SkeletonSpec(
    name="odd",
    joints=SEGMENTS,
    parents=(-1,) * 14,
    segments={name: name for name in SEGMENTS},
    axes="global",
)


def say_pose(talk: Talk, seq: int, local: np.ndarray, *, seed: int = 4) -> list:
    _, joint_axes, _ = sensor(seed)
    return talk.say(
        Frame(seq=seq, t=seq / 30, q=tuple(map(tuple, rendered(local, joint_axes, Rotation.identity())))),
    )


def calibrated(talk: Talk, **fields) -> SessionCalibrated:
    assert talk.say(SessionCalibrate(**fields)) == []
    said = [message for seq in range(31) for message in say_pose(talk, seq, held(fields.get("pose", "n")))]
    return next(message for message in said if isinstance(message, SessionCalibrated))


def moving(seq: int) -> np.ndarray:
    return Rotation.from_rotvec(np.sin(np.arange(39).reshape(13, 3) + seq / 10)).as_quat()


def test_a_strange_sensor_gives_the_estimates_of_the_rig():
    strange, plain = Talk(start=SessionStart(skeleton=ODD)), Talk(start=SessionStart())
    answer = calibrated(strange, pose="t", name="lab")
    assert (answer.skeleton.name, answer.frames, answer.unseen) == ("lab", 31, ())
    for seq in range(31, 120):
        (one,) = say_pose(strange, seq, moving(seq))
        (other,) = plain.say(Frame(seq=seq, t=seq / 30, q=tuple(map(tuple, moving(seq)))))
        assert abs(one.intensity - other.intensity) < 1e-5
    assert strange.session.totals.rejected == 0


def test_the_skeleton_that_came_back_starts_the_next_session_aligned():
    spec = calibrated(Talk(start=SessionStart(skeleton=ODD))).skeleton
    again, plain = Talk(start=SessionStart(skeleton=spec)), Talk(start=SessionStart())
    for seq in range(60):
        (one,) = say_pose(again, seq, moving(seq))
        (other,) = plain.say(Frame(seq=seq, t=seq / 30, q=tuple(map(tuple, moving(seq)))))
        assert abs(one.intensity - other.intensity) < 1e-5


def test_moving_while_calibrating_is_told_and_changes_nothing():
    talk = Talk(start=SessionStart(skeleton=ODD))
    talk.say(SessionCalibrate())
    said = [message for seq in range(40) for message in say_pose(talk, seq, moving(3 * seq))]
    (error,) = [message for message in said if isinstance(message, Error)]
    assert "not held still" in error.message
    assert not error.fatal
    assert sum(isinstance(message, Estimate) for message in said) == 40


def test_impossible_directions_are_told_at_once():
    talk = Talk(start=SessionStart(skeleton=ODD))
    (error,) = talk.say(SessionCalibrate(up=(0.0, 0.0, 0.0)))
    assert "expected two different directions" in error.message
