"""Collects a held pose from a body's frames, by their times."""

from dataclasses import dataclass, field

import numpy as np

from fervor.errors import InputError
from fervor.protocol.messages import SessionCalibrate
from fervor.session.events import Pose, Source
from fervor.skeletons.binds import Quaternion
from fervor.skeletons.calibration import Calibration, calibrate, facing
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.skeleton import Axes, Skeleton


@dataclass(slots=True)
class Calibrating:
    """A calibration under way."""

    request: SessionCalibrate
    skeleton: Skeleton
    axes: Axes
    person: Quaternion
    _poses: list[Pose] = field(default_factory=list)
    _start: float | None = None  # seconds, client clock

    @classmethod
    def begin(cls, request: SessionCalibrate, source: Source) -> "Calibrating":
        """A calibration of a session's source.

        Raises:
            InputError: a landmark sensor, which has no joint axes to align, or directions that make no sense.
        """
        if isinstance(source.skeleton, Landmarks):
            raise InputError(f"{source.skeleton.name!r} sends positions, which need no calibration")
        return cls(request, source.skeleton, source.axes, facing(request.up, request.forward))

    @property
    def begun(self) -> bool:
        """Whether a frame came."""
        return self._start is not None

    def add(self, time: float, pose: Pose) -> Calibration | None:
        """Take a frame; the calibration once the pose was held long enough.

        Raises:
            InputError: it was not held still.
        """
        if self._start is None:
            self._start = time
        self._poses.append(pose.copy())
        if len(self._poses) > MOST_FRAMES:
            raise InputError(f"{MOST_FRAMES} frames came before {self.request.seconds} s were over; check t")
        if time - self._start < self.request.seconds:
            return None
        return calibrate(
            self.skeleton,
            np.stack([pose.joints for pose in self._poses]),
            np.stack([pose.observed for pose in self._poses]),
            axes=self.axes,
            pose=self.request.pose,
            person=self.person,
        )


MOST_FRAMES = 5000
"""A pose held for ten seconds at 500 Hz; more means that the clock stands still."""
