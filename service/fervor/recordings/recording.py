"""A recording: one take of one body, as its file gave it, with its time stamps."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.skeletons.adapter import adapt
from fervor.skeletons.skeleton import Axes, Skeleton


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Rotations of a source skeleton over time.

    Times are in seconds from the first frame, as the file says them (a BVH "Frame Time" of 0.0083333 is taken at its
    word, not rounded to 120 Hz), and rise strictly.
    """

    name: str
    skeleton: Skeleton
    times: npt.NDArray[np.float64]  # [frame] seconds
    rotations: npt.NDArray[np.float64]  # [frame, joint, 4] xyzw
    observed: npt.NDArray[np.bool_]  # [frame, joint]
    axes: Axes

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rate_hz(self) -> float:
        """Median frame rate; 0 for fewer than two frames."""
        return float(1.0 / np.median(np.diff(self.times))) if len(self.times) > 1 else 0.0

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame."""
        return float(self.times[-1] - self.times[0]) if len(self.times) else 0.0


def rig_poses(
    recording: Recording,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """A recording on the rig: times [frame] in seconds, local rotations [frame, 13, 4] xyzw, observed [frame, 13]."""
    local, observed = adapt(recording.skeleton, recording.rotations, recording.observed, axes=recording.axes)
    return recording.times, local, observed
