"""Tables of numbers become recordings: by names, orders and masks; what doesn't fit is refused."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import RecordingError
from fervor.recordings.tabular import Table, to_recording
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.landmarks import LANDMARKS, landmarks
from fervor.skeletons.positions import local_over_time

Array = npt.NDArray[np.float64]
FRAMES = 5


def rotations(count: int, seed: int = 0) -> Array:
    return Rotation.random(FRAMES * count, random_state=seed).as_quat().reshape(FRAMES, count, 4)


def table(values: Array, **changes: object) -> Table:
    given: dict[str, object] = {"label": "take.csv", "name": "take", "values": values, "rate_hz": 50.0}
    return Table(**{**given, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("name", SKELETONS)
def test_every_skeleton_is_known_by_name_and_by_its_joints(name: str) -> None:
    known = skeleton(name)
    values = rotations(len(known.joints))
    sent = np.roll(values, 1, axis=-1) if known.quaternion == "wxyz" else values
    by_name = to_recording(table(sent, skeleton=name))
    by_argument = to_recording(table(sent, skeleton="nonsense"), name)
    by_object = to_recording(table(sent), known)
    by_joints = to_recording(table(sent, joints=known.joints))
    for recording in (by_name, by_argument, by_object, by_joints):
        assert recording.skeleton is known
        assert recording.axes == known.axes
        assert np.array_equal(recording.rotations, values)
        assert recording.observed.all()
        assert np.allclose(recording.times, np.arange(FRAMES) / 50)


def test_axes_and_order_can_be_said() -> None:
    known = skeleton("kinect_v2")
    values = rotations(25)
    recording = to_recording(
        table(np.roll(values, 1, axis=-1), skeleton="kinect_v2", axes="local", quaternion="wxyz")
    )  # fmt: skip
    assert recording.skeleton is known
    assert recording.axes == "local"
    assert np.array_equal(recording.rotations, values)


def test_some_joints_in_any_order() -> None:
    known = skeleton("kinect_v2")
    names = ("ElbowLeft", "SpineBase", "SpineShoulder")
    values = rotations(3)
    recording = to_recording(table(values, joints=names, skeleton="kinect_v2"))
    for at, joint in enumerate(names):
        assert np.array_equal(recording.rotations[:, known.joints.index(joint)], values[:, at])
    assert recording.observed.sum() == 3 * FRAMES


def test_gaps_are_unobserved() -> None:
    values = rotations(13)
    values[1, 2] = np.nan
    values[2, 3, 1] = np.nan
    observed = np.ones((FRAMES, 13), np.bool_)
    observed[4, 5] = False
    recording = to_recording(table(values, skeleton="c13", observed=observed))
    gaps = {tuple(gap) for gap in np.argwhere(~recording.observed).tolist()}
    assert gaps == {(1, 2), (2, 3), (4, 5)}
    assert np.isfinite(recording.rotations).all()


@pytest.mark.parametrize("name", LANDMARKS)
def test_positions_become_canonical_rotations(name: str) -> None:
    known = landmarks(name)
    values = np.random.default_rng(0).normal(size=(FRAMES, len(known.joints), 3))
    local, seen = local_over_time(known, values, np.ones(values.shape[:-1], np.bool_))
    for recording in (
        to_recording(table(values, skeleton=name)),
        to_recording(table(values), name),
        to_recording(table(values, joints=known.joints)),
    ):
        assert recording.skeleton is skeleton("c13")
        assert recording.axes == "local"
        assert np.array_equal(recording.rotations, local)
        assert np.array_equal(recording.observed, seen)


def test_times_count_from_the_first_frame() -> None:
    times = np.array([10.0, 10.1, 10.3, 10.35, 11.0])
    recording = to_recording(table(rotations(13), skeleton="c13", times=times, rate_hz=None))
    assert np.allclose(recording.times, times - 10.0)


BAD = rotations(13)


def broken() -> dict[str, tuple[Table, str]]:
    infinite, long = BAD.copy(), BAD.copy()
    infinite[3, 2, 1] = np.inf
    long[2, 4] *= 3
    c13 = {"skeleton": "c13"}
    times = np.arange(FRAMES, dtype=np.float64)
    return {
        "shape": (table(BAD[..., :2], **c13), "numbers have the shape [5, 13, 2]; expected [frame, joint, 4 or 3]"),
        "flat": (table(BAD[0], **c13), "numbers have the shape [13, 4]"),
        "no frames": (table(BAD[:0], **c13), "numbers have the shape [0, 13, 4]"),
        "no times": (table(BAD, rate_hz=None, **c13), "neither times nor a rate_hz over 0"),
        "rate 0": (table(BAD, rate_hz=0.0, **c13), "neither times nor a rate_hz over 0"),
        "few times": (table(BAD, times=times[:3], **c13), "3 times for 5 frames; expected one each"),
        "time NaN": (table(BAD, times=times * [1, 1, np.nan, 1, 1], **c13), "time of frame 2 is not a finite number"),
        "time stands": (table(BAD, times=np.minimum(times, 3), **c13), "the time of frame 4 does not rise"),
        "infinite": (table(infinite, **c13), "frame 3 holds an infinite number"),
        "far": (table(long, **c13), "frame 2 has a quaternion far from unit length at joint 4"),
        "mask": (table(BAD, observed=np.ones((5, 12), np.bool_), **c13), "the mask has the shape [5, 12]"),
        "joints": (table(BAD[:, :12], **c13), "skeleton 'c13' has 13 joints; got 12, and no names for them"),
        "names": (table(BAD, joints=("a",), **c13), "1 different joint names for 13 joints; expected one each"),
        "twice": (table(BAD[:, :2], joints=("head", "head"), **c13), "1 different joint names for 2 joints"),
        "unknown joint": (table(BAD[:, :1], joints=("tail",), **c13), "has no joint 'tail'; expected some of spine"),
        "unknown skeleton": (table(BAD, skeleton="kinect9"), "skeleton 'kinect9' is not known"),
        "no skeleton": (table(BAD), "it names no skeleton, and its joints fit none; expected one of c13"),
        "no sensor": (table(BAD[..., :3]), "it names no landmark sensor, and its points fit none"),
        "a skeleton's positions": (table(BAD[..., :3], **c13), "landmark sensor 'c13' is not known"),
        "axes": (table(BAD, axes="world", **c13), "axes is 'world'; expected 'local' or 'global'"),
        "global rig": (table(BAD, axes="global", **c13), "no pelvis joint; expected local rotations"),
        "order": (table(BAD, quaternion="yxzw", **c13), "quaternion is 'yxzw'; expected 'xyzw' or 'wxyz'"),
    }  # fmt: skip


@pytest.mark.parametrize("case", broken())
def test_what_does_not_fit_is_refused(case: str) -> None:
    given, sentence = broken()[case]
    with pytest.raises(RecordingError) as caught:
        to_recording(given)
    assert sentence in caught.value.message
    assert caught.value.message.startswith("take.csv: ")


def test_positions_of_a_rotation_skeleton_are_refused() -> None:
    with pytest.raises(RecordingError, match="expected a landmark sensor, not the skeleton 'c13'"):
        to_recording(table(BAD[..., :3]), skeleton("c13"))
