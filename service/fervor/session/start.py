"""What `session.start` asks for, checked and turned into what every frame needs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fervor.emotions import emotion_vector
from fervor.errors import FrameError, InputError
from fervor.metadata import ModelMetadata
from fervor.protocol.lean_frame import LeanFrame
from fervor.protocol.messages import Emotion, Frame, SessionStart
from fervor.protocol.pose_blocks import PoseBlock, Sent, position_block, rotation_block
from fervor.protocol.poses import frame_points, frame_pose
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.session.body import Terms
from fervor.session.checkpoint import digest
from fervor.session.events import Pose, Source
from fervor.session.label import NO_LABEL, Label, make_label
from fervor.skeletons.adapter import check_axes
from fervor.skeletons.catalog import source
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.skeleton import Axes, QuaternionOrder, Skeleton


class SentJoints(Protocol):
    """The joints of a frame, as they came."""

    @property
    def q(self) -> Sent:
        """Rotations."""

    @property
    def p(self) -> Sent:
        """Positions."""

    @property
    def mask(self) -> Sequence[bool] | None:
        """Which are tracked."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """How joints lie in a frame; one object for all sessions that agreed on the same."""

    rotations: bool
    """Else positions."""
    joints: int
    """Sent."""
    order: QuaternionOrder
    known: int
    """Joints of the source."""
    places: npt.NDArray[np.intp] | None
    """[joint sent] its place in the source; None where all are sent in the source's order."""

    def read(self, frames: Sequence[SentJoints]) -> PoseBlock:
        """The joints of frames at once, in the order of the source; those that are not sent are unobserved."""
        masks = [frame.mask for frame in frames]
        if self.rotations:
            rotations = [frame.q if frame.p is None else None for frame in frames]
            block = rotation_block(rotations, masks, self.joints, self.order)
        else:
            positions = [frame.p if frame.q is None else None for frame in frames]
            block = position_block(positions, masks, self.joints)
        return PoseBlock(*self.arranged(block.joints, block.observed), block.doubtful)

    def arranged(
        self, joints: npt.NDArray[np.float64], observed: npt.NDArray[np.bool_]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Joints as they were sent, [..., joint, k] and [..., joint], in the order of the source; others unobserved."""
        if self.places is None:
            return joints, observed
        arranged = np.zeros((*joints.shape[:-2], self.known, joints.shape[-1]))
        seen = np.zeros(arranged.shape[:-1], np.bool_)
        arranged[..., self.places, :], seen[..., self.places] = joints, observed
        return arranged, seen


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """The terms of a session, and how its frames are read."""

    terms: Terms
    joints: tuple[str, ...]
    """Joints in every frame, in this order."""
    order: QuaternionOrder
    latest: bool
    """Only the newest estimate of a body is wanted."""
    emotion: Emotion | None
    frame_s: float
    """Seconds a frame stands for where it brings no time (clock `frames`)."""
    layout: Layout

    def first_label(self, time: float) -> Label:
        """The label of a body that comes at `time` (seconds, client clock)."""
        return NO_LABEL if self.emotion is None else make_label(self.emotion, time, self.terms.emotion_ttl_s)

    def time_of(self, frame: Frame | LeanFrame) -> float:
        """The frame's time in seconds.

        Raises:
            FrameError: clock `time`, and the frame has none.
        """
        if frame.t is not None:
            return frame.t
        if self.terms.clock == "frames":
            return frame.seq * self.frame_s
        raise FrameError(f"frame {frame.seq} of body {frame.body!r} has no t; clock 'time' needs seconds")

    @property
    def digest(self) -> str:
        """What a checkpoint is bound to: everything agreed that shapes an estimate or the meaning of a frame.

        A tree is known by what it is and not by its name, which a calibration may change.
        """
        terms, known = self.terms, self.terms.source.skeleton
        if isinstance(known, Landmarks):
            kind: tuple[object, ...] = (known.name, known.joints, sorted(known.points.items()))
        else:
            kind = (known.joints, known.parents, known.drives, known.bind.tobytes())
        return digest(
            {
                "joints": self.joints,
                "order": self.order,
                "axes": terms.source.axes,
                "skeleton": (*kind, known.noisy),
                "clock": (terms.clock, self.frame_s),
                "memory": terms.memory,
                "emotion": (emotion_vector(self.emotion).tolist(), terms.emotion_ttl_s),
                "kind of label": isinstance(self.emotion, str),
            }
        )

    def pose_of(self, frame: Frame) -> Pose:
        """The frame's joints, checked, in the order of the source; joints that are not sent are unobserved.

        Raises:
            FrameError: the frame is poisoned; see `fervor.protocol.poses`.
        """
        if isinstance(self.terms.source.skeleton, Landmarks):
            joints, observed = frame_points(frame, self.joints)
        else:
            joints, observed = frame_pose(frame, self.joints, self.order)
        return Pose(*self.layout.arranged(joints, observed))

    def aligned(self, skeleton: Skeleton) -> "Agreement":
        """The same agreement for the same sensor under another alignment."""
        return replace(self, terms=replace(self.terms, source=Source(skeleton, self.terms.source.axes)))


def agree(
    start: SessionStart, metadata: ModelMetadata, skeletons: Mapping[str, Skeleton] = MappingProxyType({})
) -> Agreement:
    """Check a `session.start` against what the service can do; `skeletons` are those beside the catalogue's.

    Raises:
        InputError: an unknown skeleton, joint or emotion, or axes that the skeleton can't have.
    """
    known = _known(start.skeleton, skeletons)
    sensor = _source(known, "global" if isinstance(known, Landmarks) else start.axes or known.axes)
    if isinstance(known, Skeleton):
        check_axes(known, sensor.axes)
    if start.emotion is not None:
        emotion_vector(start.emotion)
    joints, places = start.joints or known.joints, _places(start.joints, known.joints, known.name)
    order = start.quaternion or (known.quaternion if isinstance(known, Skeleton) else "xyzw")
    among = None if places is None else tuple(places.tolist())
    return Agreement(
        terms=Terms(
            metadata=metadata,
            source=sensor,
            clock=start.clock,
            memory=start.memory,
            emotion_ttl_s=start.emotion_ttl_s,
            by_emotion=start.by_emotion,
            checkpoint_s=start.checkpoint_s,
        ),
        joints=joints,
        order=order,
        latest=start.delivery == "latest",
        emotion=start.emotion,
        frame_s=1.0 / (start.nominal_hz or metadata.rate_hz),
        layout=_layout(isinstance(known, Skeleton), len(joints), order, len(known.joints), among),
    )


@lru_cache(maxsize=64)
def _source(skeleton: Skeleton | Landmarks, axes: Axes) -> Source:
    """One object for all sessions with this sensor."""
    return Source(skeleton, axes)


@lru_cache(maxsize=64)
def _layout(rotations: bool, joints: int, order: QuaternionOrder, known: int, places: tuple[int, ...] | None) -> Layout:
    return Layout(rotations, joints, order, known, None if places is None else np.array(places, np.intp))


def _known(asked: str | SkeletonSpec, skeletons: Mapping[str, Skeleton]) -> Skeleton | Landmarks:
    if isinstance(asked, SkeletonSpec):
        return asked.to_skeleton()
    return skeletons.get(asked) or source(asked)


def _places(sent: tuple[str, ...] | None, known: tuple[str, ...], name: str) -> npt.NDArray[np.intp] | None:
    if sent is None or sent == known:
        return None
    if not sent:
        raise InputError("joints is empty; expected the names of those that are sent, or no joints at all")
    place = {joint: index for index, joint in enumerate(known)}
    unknown = [joint for joint in sent if joint not in place]
    if unknown:
        raise InputError(f"skeleton {name!r} has no joint {unknown[0]!r}; expected some of {', '.join(known)}")
    if len(set(sent)) != len(sent):
        raise InputError("joints names a joint twice; expected each at most once")
    return np.array([place[joint] for joint in sent], np.intp)
