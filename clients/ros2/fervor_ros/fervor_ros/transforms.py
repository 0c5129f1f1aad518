"""Poses of one body from the transforms that TF tells.

Rules. A local rotation is the product of the transforms from the link's parent in the skeleton down to the link. Where
neither lies above the other both are followed up to where they meet, and what is above never enters. A pose is whole
once all frames have come that have moved lately, or when a newer stamp comes; a frame that missed a stamp is untracked
in its pose. Static frames hold for ever.

tf2's buffer is not used: it interpolates between stamps, and a pose shall enter the recurrence as it was measured.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.rotations import conjugate, multiply
from fervor.skeletons.skeleton import Skeleton
from fervor_ros.pose import STEP_BACK_NS, Pose, Stamp

Rotation = npt.NDArray[np.float64]
"""[4] xyzw."""

DEEPEST = 64
"""Frames between a link and the root; more are a loop."""


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """One `geometry_msgs/TransformStamped`, as far as its rotation goes."""

    frame: str
    parent: str
    rotation: Rotation
    stamp: Stamp


class Transforms:
    """The frames of one body."""

    def __init__(self, body: str, skeleton: Skeleton, fixed: Mapping[str, Transform]) -> None:
        """`fixed`: static transforms by frame, those of others among them; it may grow."""
        self._body = body
        self._skeleton = skeleton
        self._fixed = fixed
        self._moving: dict[str, Transform] = {}
        self._stamp: Stamp | None = None
        """Of the pose that is under way, or was given last."""
        self._given = True
        self._come: set[str] = set()
        self._expected: set[str] = set()
        """Frames that the last pose had."""

    def move(self, transform: Transform) -> list[Pose]:
        """Take a transform; give the poses that are whole with it."""
        poses = []
        if self._stamp is not None and 0 < self._stamp - transform.stamp <= STEP_BACK_NS:
            return []
        if self._stamp != transform.stamp:
            poses += self.flush()
            self._stamp, self._given, self._come = transform.stamp, False, set()
        self._moving[transform.frame] = transform
        self._come.add(transform.frame)
        if self._expected and self._come >= self._expected:
            poses += self.flush()
        return poses

    def flush(self) -> list[Pose]:
        """Give the pose that is under way as it is."""
        self._expected = set(self._come) or self._expected
        if self._given or self._stamp is None:
            return []
        self._given = True
        return [Pose(self._body, self._stamp, self._rotations(self._stamp))]

    def _rotations(self, stamp: Stamp) -> npt.NDArray[np.float64]:
        """[joint, 4] at a stamp; NaN where untracked."""
        skeleton = self._skeleton
        rotations = np.full((len(skeleton.joints), 4), np.nan)
        for index, parent in enumerate(skeleton.parents):
            if parent < 0:
                rotations[index] = (0.0, 0.0, 0.0, 1.0)  # nothing rests on where the body stands
            else:
                rotations[index] = self._between(skeleton.joints[parent], skeleton.joints[index], stamp)
        return rotations

    def _between(self, above: str, below: str, stamp: Stamp) -> Rotation:
        """The rotation from one link to another; NaN where the way is not known at this stamp."""
        up, down = self._way(above, stamp), self._way(below, stamp)
        names = [transform.frame for transform in up]
        start = f"{above}_{self._body}"
        shared = {start, *names} | {transform.parent for transform in up}
        path: list[Transform] = []
        for transform in down:
            path.append(transform)
            if transform.parent in shared:
                break
        else:
            return np.full(4, np.nan)
        turn = _product(path)
        meeting = path[-1].parent
        if meeting == start:
            return turn
        back = _product(up[: [transform.parent for transform in up].index(meeting) + 1])
        return multiply(conjugate(back), turn)

    def _way(self, link: str, stamp: Stamp) -> list[Transform]:
        """Transforms from a link upwards, as far as they are known at this stamp."""
        way: list[Transform] = []
        frame = f"{link}_{self._body}"
        while len(way) < DEEPEST and (transform := self._at(frame, stamp)) is not None:
            way.append(transform)
            frame = transform.parent
        return way

    def _at(self, frame: str, stamp: Stamp) -> Transform | None:
        moving = self._moving.get(frame)
        if moving is not None:
            return moving if moving.stamp == stamp else None
        return self._fixed.get(frame)


def _product(way: Sequence[Transform]) -> Rotation:
    """The rotation of a way that is told from below."""
    turn = way[-1].rotation
    for transform in reversed(way[:-1]):
        turn = multiply(turn, transform.rotation)
    return turn
