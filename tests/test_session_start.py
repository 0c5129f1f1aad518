"""What `session.start` may ask for."""

import pytest

from bodies import model
from fervor.errors import FrameError, InputError
from fervor.protocol.messages import Frame, SessionStart
from fervor.session.start import agree


def agreed(**fields):
    return agree(SessionStart(**fields), model().metadata)


def test_defaults_are_the_skeletons_own():
    agreement = agreed()
    assert agreement.joints[0] == "spine"
    assert (agreement.order, agreement.terms.source.axes) == ("xyzw", "local")
    assert agreement.layout.places is None


def test_a_subset_of_joints_in_the_clients_order():
    pose = agreed(joints=("head", "spine")).pose_of(Frame(seq=0, t=0.0, q=((0, 0, 0, 1.0), None)))
    assert pose.joints[2].tolist() == [0, 0, 0, 1]
    assert pose.observed.tolist() == [False, False, True, *[False] * 10]


def test_landmark_sensors_send_positions():
    agreement = agreed(skeleton="coco17", joints=("left_elbow", "nose"))
    pose = agreement.pose_of(Frame(seq=0, t=0.0, p=((1.0, 2.0, 3.0), None)))
    assert pose.joints.shape == (17, 3)
    assert pose.joints[7].tolist() == [1.0, 2.0, 3.0]
    assert pose.observed.sum() == 1
    with pytest.raises(FrameError, match="expected positions in p alone"):
        agreement.pose_of(Frame(seq=0, t=0.0, q=(None, None)))


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"skeleton": "kinekt"}, "kinekt"),
        ({"joints": ("head", "tail")}, "no joint 'tail'; expected some of spine, chest"),
        ({"joints": ("head", "head")}, "twice"),
        ({"emotion": "joie"}, "'joie' is not known"),
        ({"axes": "global"}, "expected local rotations"),
    ],
)
def test_what_cannot_be_is_told(fields, told):
    with pytest.raises(InputError) as caught:
        agreed(**fields)
    assert told in caught.value.message


def test_times_come_from_the_frame_or_from_the_rate():
    assert agreed().time_of(Frame(seq=9, t=2.5, q=())) == 2.5
    assert agreed(clock="frames", nominal_hz=10).time_of(Frame(seq=9, q=())) == pytest.approx(0.9)
    with pytest.raises(FrameError, match="frame 9 of body '0' has no t"):
        agreed().time_of(Frame(seq=9, q=()))


def test_an_empty_list_of_joints_is_refused():
    with pytest.raises(InputError, match="joints is empty"):
        agree(SessionStart(joints=()), model().metadata)
