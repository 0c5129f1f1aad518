"""The strip of poses: the standard body at even moments, from the front, in the colour of its intensity.

A pose has no root, so the body always faces the reader: its left is on the right. Limbs whose joint was not seen keep
their last pose and are dotted.
"""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse

from fervor.cli.picture.palette import LIGHT, between
from fervor.cli.picture.trace import Trace, last_seen, moments, nearest
from fervor.skeletons.rig import CHILD_SEGMENT, SEGMENTS
from fervor.skeletons.standard_body import BONES, LIMBS, points

LOWEST_M, HIGHEST_M = -0.98, 1.22
"""What a body reaches of the strip's height: feet on the floor, arms up; metres from the hips."""

HEAD_M = 0.105
"""Radius of the head."""


def draw_strip(axes: Axes, trace: Trace, *, count: int, seconds_per_metre: float) -> list[int]:
    """Draw at most `count` bodies, each above its time.

    Args:
        axes: whose horizontal axis is the time in seconds.
        trace: what to draw.
        count: how many bodies.
        seconds_per_metre: so much time is as wide on the page as a metre of the body is high.

    Returns:
        The frames that were drawn.
    """
    axes.set_ylim(LOWEST_M, HIGHEST_M)
    axes.set_axis_off()
    frames = moments(trace, count)
    if not frames:
        return frames
    held = last_seen(trace.poses)[frames]
    places = points(held)
    unseen = np.asarray(np.isnan(trace.poses[frames]).any(-1))  # [moment, joint]
    for number, frame in enumerate(frames):
        time = float(trace.times[frame])
        intensity = nearest(trace, time).intensity
        colour = LIGHT.quiet if intensity is None else between(LIGHT.weak, LIGHT.strong, intensity)
        at = {name: place[number, :2] * (seconds_per_metre, 1.0) + (time, 0.0) for name, place in places.items()}
        _draw_body(axes, at, unseen[number], colour, seconds_per_metre)
    return frames


def _draw_body(
    axes: Axes,
    at: dict[str, npt.NDArray[np.float64]],
    unseen: npt.NDArray[np.bool_],
    colour: str,
    seconds_per_metre: float,
) -> None:
    for start, end in LIMBS:
        seen = not unseen[list(_turned_by(end))].any()
        (x0, y0), (x1, y1) = at[start], at[end]
        axes.plot(
            [x0, x1],
            [y0, y1],
            color=colour,
            linewidth=2.0 if seen else 1.1,
            linestyle="-" if seen else (0, (1.0, 1.4)),
            alpha=1.0 if seen else 0.6,
            solid_capstyle="round",
            clip_on=False,
        )
    head = Ellipse(tuple(at["head"]), 2 * HEAD_M * seconds_per_metre, 2 * HEAD_M, clip_on=False)
    head.set(facecolor=colour, edgecolor=LIGHT.paper, linewidth=0.8, zorder=3)
    axes.add_patch(head)


def _turned_by(point: str) -> tuple[int, ...]:
    """The joint that turns the segment on which a point lies; none for the pelvis, which is upright anyway."""
    side, kind = point[:2], point.removeprefix("r_").removeprefix("l_")
    segment = BONES[kind if kind in BONES else f"l_{kind}"][1]
    segment = f"r{segment[1:]}" if side == "r_" and segment.startswith("l_") else segment
    number = SEGMENTS.index(segment)
    return (CHILD_SEGMENT.index(number),) if number in CHILD_SEGMENT else ()
