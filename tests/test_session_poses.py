"""Poses read in blocks are those read one by one, to the bit, and so are the sentences on poisoned ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bodies import model, motion
from fervor.errors import FrameError
from fervor.protocol.lean_frame import LeanFrame
from fervor.protocol.messages import SessionStart
from fervor.session.events import Pose
from fervor.session.poses import read_poses
from fervor.session.start import Agreement, agree

STARTS = [
    SessionStart(skeleton="c13"),
    SessionStart(skeleton="c13", quaternion="wxyz"),
    SessionStart(skeleton="c13", joints=("r_elbow", "spine", "head")),
    SessionStart(skeleton="kinect_v2"),
    SessionStart(skeleton="mediapipe"),
]


def plainly(agreement: Agreement, frame: LeanFrame) -> Pose | FrameError:
    try:
        return agreement.pose_of(frame.to_frame())
    except FrameError as error:
        return error


def told(read: Pose | FrameError) -> object:
    if isinstance(read, FrameError):
        return read.message, read.body, read.seq
    return read.joints.tobytes(), read.joints.shape, read.observed.tolist(), read.lost


def frame(agreement: Agreement, seq: int, spoil: str) -> LeanFrame:
    joints = motion(1, seed=seq, joints=len(agreement.joints))[0].astype(np.float32)
    match spoil:
        case "nan":
            joints[-1, 2] = np.nan
        case "long":
            joints[0] *= 3.0
        case "huge":
            joints[0] = 3e38
        case "untracked":
            joints[seq % len(joints)] = 0.0
        case "short":
            joints[0] *= 0.4
        case "lost":
            joints[:] = 0.0
        case "fewer":
            joints = joints[1:]
    return LeanFrame(seq=seq, q=joints.astype("<f4").tobytes(), t=0.0)


spoils = st.sampled_from(["", "", "nan", "long", "huge", "untracked", "short", "lost", "fewer"])


@given(st.lists(st.tuples(st.integers(0, len(STARTS) - 1), spoils), max_size=20))
def test_a_block_gives_each_frame_what_it_gets_alone(kinds) -> None:
    agreements = [agree(start, model().metadata) for start in STARTS]
    frames = [(agreements[kind], frame(agreements[kind], seq, spoil)) for seq, (kind, spoil) in enumerate(kinds)]
    assert [told(read) for read in read_poses(frames)] == [told(plainly(*each)) for each in frames]


@pytest.mark.parametrize("start", STARTS[:4])
def test_frames_of_one_layout_share_a_block_whoever_sent_them(start) -> None:
    frames = [
        (agreement, frame(agreement, seq, "")) for seq in range(3) if (agreement := agree(start, model().metadata))
    ]
    poses = [read for read in read_poses(frames) if isinstance(read, Pose)]
    assert len({id(pose.block) for pose in poses}) == 1
    assert [pose.row for pose in poses] == [0, 1, 2]
    kept = poses[0].copy()
    assert kept.block is None
    assert told(kept) == told(poses[0])
