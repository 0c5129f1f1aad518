"""Collects a held pose from a body's frames, by their times."""

from dataclasses import dataclass, field

import numpy as np

from fervor.errors import InputError
from fervor.protocol.messages import SessionCalibrate
from fervor.session.events import Pose, Source
from fervor.skeletons.calibration import Calibration, calibrate, facing


@dataclass(slots=True)
class Calibrating:
    """A calibration under way."""

    request: SessionCalibrate
    source: Source
    _poses: list[Pose] = field(default_factory=list)
    _start: float | None = None  # seconds, client clock

    def add(self, time: float, pose: Pose) -> Calibration | None:
        """Take a frame; the calibration once the pose was held long enough.

        Raises:
            InputError: it was not held still.
        """
        if self._start is None:
            self._start = time
        self._poses.append(pose)
        if len(self._poses) > MOST_FRAMES:
            raise InputError(f"{MOST_FRAMES} frames came before {self.request.seconds} s were over; check t")
        if time - self._start < self.request.seconds:
            return None
        return calibrate(
            self.source.skeleton,
            np.stack([pose.rotations for pose in self._poses]),
            np.stack([pose.observed for pose in self._poses]),
            axes=self.source.axes,
            pose=self.request.pose,
            person=facing(self.request.up, self.request.forward),
        )


MOST_FRAMES = 5000
"""A pose held for ten seconds at 500 Hz; more means that the clock stands still."""
