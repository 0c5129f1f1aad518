"""One calibration at a time; it is over when its body is gone, unless it only waits for that body."""

import numpy as np
import pytest

from bodies import motion, terms
from fervor.errors import InputError
from fervor.protocol.messages import SessionCalibrate
from fervor.session.body import Body
from fervor.session.calibrator import Calibrator
from fervor.session.events import Pose

ALL = np.ones(25, np.bool_)
STILL = Pose(np.tile([0.0, 0.0, 0.0, 1.0], (25, 1)), ALL)


def begun(body: str = "eve", *, frames: int = 1) -> tuple[Calibrator, Body]:
    agreed = terms("kinect_v2")
    calibrator, known = Calibrator(), Body(body, 0, agreed)
    calibrator.begin(SessionCalibrate(body=body, seconds=0.5), agreed.source)
    for seq in range(frames):
        assert calibrator.add(known.plan(seq, seq / 30, STILL), STILL) is None
    return calibrator, known


def test_a_pose_held_long_enough_is_told_once() -> None:
    calibrator, body = begun(frames=15)
    assert calibrator.holds("eve")
    found = calibrator.add(body.plan(15, 0.5, STILL), STILL)
    assert found is not None
    assert (found[1].frames, found[1].spread_deg) == (16, pytest.approx(0.0, abs=1e-6))
    assert calibrator.under_way is None


def test_a_pose_that_is_not_held_still_ends_it() -> None:
    calibrator, body = begun(frames=15)
    moved = Pose(motion(1, seed=3, joints=25, speed=1.0)[0], ALL)
    with pytest.raises(InputError):
        calibrator.add(body.plan(15, 0.5, moved), moved)
    assert calibrator.under_way is None


def test_it_goes_with_its_body_and_waits_for_one_that_is_still_to_come() -> None:
    calibrator, _ = begun()
    assert calibrator.gone("adam") is None
    assert "was gone" in calibrator.gone("eve").message
    assert calibrator.under_way is None
    waiting, _ = begun(frames=0)
    assert waiting.gone("eve") is None
    assert waiting.under_way is not None


def test_a_newcomer_ends_it_where_its_body_was_forgotten() -> None:
    for newcomer, bodies, over in (("adam", {"eve"}, False), ("adam", set(), True), ("eve", {"eve"}, True)):
        calibrator, _ = begun()
        held, error = calibrator.replaced(newcomer, bodies)
        assert (held, error is not None) == ("eve", over)
