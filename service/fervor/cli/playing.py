"""Playing a recording into a session, as a sensor would send it."""

import asyncio
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from fervor.cli.screens import Screen
from fervor.recordings.recording import Recording, rig_poses
from fervor_client import Session

SEAM_S = 0.2
"""Time between the end of a repeated recording and its next beginning: short enough to be interpolated."""

TimedPose = tuple[float, npt.NDArray[np.float64]]
"""Seconds, and a pose [13, 4] with NaN where a joint is not observed."""


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """A recording on the rig."""

    name: str
    times: npt.NDArray[np.float64]  # [frame] seconds
    poses: npt.NDArray[np.float64]  # [frame, 13, 4] xyzw, NaN where not observed

    @classmethod
    def of(cls, recording: Recording) -> Self:
        """The take that a recording is."""
        times, rotations, observed = rig_poses(recording)
        return cls(recording.name, times, np.where(observed[..., np.newaxis], rotations, np.nan))

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame."""
        return float(self.times[-1] - self.times[0])

    def frames(self, *, loop: bool = False, seconds: float | None = None) -> Iterator[TimedPose]:
        """The frames in order, over and over where `loop`, up to `seconds`; time always rises."""
        shift = 0.0
        while True:
            for time, pose in zip(self.times.tolist(), self.poses, strict=True):
                if seconds is not None and time + shift > seconds:
                    return
                yield time + shift, pose
            if not loop:
                return
            shift += self.duration_s + SEAM_S


async def play(
    session: Session, frames: Iterable[TimedPose], screen: Screen, *, body: str = "0", fast: bool = False
) -> None:
    """Send frames and show their estimates, until all are answered. The session is ended in any case.

    Args:
        session: of skeleton c13.
        frames: to send.
        screen: shows the estimates.
        body: whose frames they are.
        fast: send as fast as the service answers and allows, instead of when each frame is due.

    Raises:
        FervorError: the session was lost.
    """
    sender = asyncio.create_task(_send_all(session, frames, body, fast=fast))
    try:
        async for estimate in session:
            screen.show(estimate)
        await sender
    finally:
        sender.cancel()
        await asyncio.gather(sender, return_exceptions=True)


async def _send_all(session: Session, frames: Iterable[TimedPose], body: str, *, fast: bool) -> None:
    loop = asyncio.get_running_loop()
    begin, first = loop.time(), None
    try:
        for number, (time, pose) in enumerate(frames):
            first = time if first is None else first
            after = number / session.limits.max_frames_per_second if fast else time - first
            # Due times are counted from the beginning, so that a late frame does not delay those after it.
            await asyncio.sleep(max(begin + after - loop.time(), 0.0))
            await session.send(pose, t=time, body=body)
    finally:
        await session.end()
