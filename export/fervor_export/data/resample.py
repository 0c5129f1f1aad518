"""A recording's poses on the model's 30 Hz grid, by the rules of a live body, all frames at once.

Rules (those of the service's session and engine; a test compares them). The first pose sets the grid. A grid step lies
between two poses: SLERP, observed where both show the joint; one at a pose is that pose. Unobserved joints hold the
rotation they had, the identity before the first. Inside a gap of more than `INTERPOLATE_S` the pose before it is held,
unobserved. A noisy sensor's joint that turns over 120° in one frame is untracked, unless it stays there.
"""

import math

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, angle_between, slerp
from fervor_export.clip import RATE_HZ

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

INTERPOLATE_S = 0.25
"""Longest gap between two poses that is bridged by SLERP."""

SAME_INSTANT_S = 1e-6
"""Times closer than this are the same instant."""

JUMP_RAD = np.radians(120.0)
JUMPS_BELIEVED = 5
"""Frames after which a rotation that was rejected in each of them is believed."""


def on_grid(
    times: Floats, local: Floats, observed: Mask, *, phase_s: float = 0.0
) -> tuple[npt.NDArray[np.float32], Mask]:
    """Poses at 30 Hz.

    Args:
        times: [pose] seconds, rising.
        local: [pose, 13, 4] on the rig, xyzw.
        observed: [pose, 13].
        phase_s: how long after the first pose the grid begins.

    Returns:
        Rotations float32 [frame, 13, 4] and mask [frame, 13].
    """
    steps = math.floor((times[-1] - times[0] - phase_s + SAME_INSTANT_S) * RATE_HZ) + 1
    grid = times[0] + phase_s + np.arange(max(steps, 0)) / RATE_HZ
    local = hold(local, observed)
    after = np.minimum(np.searchsorted(times, grid - SAME_INSTANT_S), len(times) - 1)  # the first pose not before
    before = np.maximum(after - 1, 0)
    gap = times[after] - times[before]
    share = np.where(gap > 0.0, np.minimum((grid - times[before]) / np.where(gap > 0.0, gap, 1.0), 1.0), 1.0)
    arrived = share >= 1.0
    held = (gap > INTERPOLATE_S + SAME_INSTANT_S) & (grid < times[after] - SAME_INSTANT_S)
    turned = slerp(local[before], local[after], np.broadcast_to(share[:, None], observed[after].shape))
    rotations = np.where(arrived[:, None, None], local[after], turned)
    rotations = np.where(held[:, None, None], local[before], rotations)
    seen = observed[after] & (arrived[:, None] | observed[before]) & ~held[:, None]
    return rotations.astype(np.float32), seen


def hold(local: Floats, observed: Mask) -> Floats:
    """Rotations [pose, joint, 4] in which unobserved joints keep what they had."""
    poses = np.arange(len(local))[:, None]
    last = np.maximum.accumulate(np.where(observed, poses, -1), axis=0)  # [pose, joint]
    kept = np.take_along_axis(local, np.maximum(last, 0)[..., None], axis=0)
    return np.where(last[..., None] < 0, IDENTITY, kept)


def without_jumps(local: Floats, observed: Mask) -> Mask:
    """The mask [pose, joint] of a noisy sensor less the joints that flipped."""
    kept = observed.copy()
    last = np.broadcast_to(IDENTITY, local.shape[1:]).copy()  # [joint, 4]
    known, jumps = np.zeros(local.shape[1], np.bool_), np.zeros(local.shape[1], np.int64)
    for pose, (rotations, seen) in enumerate(zip(local, observed, strict=True)):
        comparable = seen & (known | (jumps > 0))
        far = comparable & (angle_between(last, rotations) > JUMP_RAD)
        rejected = far & (jumps + 1 < JUMPS_BELIEVED)
        jumps = np.where(rejected, jumps + 1, np.where(seen, 0, jumps))
        known = seen & ~rejected
        last = np.where(known[:, None], rotations, last)
        kept[pose] = known
    return kept
