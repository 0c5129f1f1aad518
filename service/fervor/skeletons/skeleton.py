"""What is known of one kind of sensor or file: joints, axes, and how its rotations become the rig's. Data, no code."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS

Axes = Literal["local", "global"]
"""`local`: relative to the parent joint; `global`: relative to the sensor or the world."""

QuaternionOrder = Literal["xyzw", "wxyz"]
"""Order of a quaternion's four numbers on the wire or in a file; inside fervor it is always xyzw."""

ROOT = -1
"""As a parent: none. As a drive: the frame in which local root joints live, for sources that send no pelvis joint."""


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """A named joint tree and its relation to the rig C13.

    For a segment j with absolute orientation Q_j the rig's joint below parent segment p is
    `A_p (Q_p^-1 Q_j) A_j^-1` with the bind alignment A of the segments (reference pose → N-pose).
    """

    name: str
    title: str
    """For people: "Kinect v2 (25 joints)"."""
    joints: tuple[str, ...]
    """Names, in the order in which the source sends them."""
    parents: tuple[int, ...]
    """Index of each joint's parent in `joints`; -1 for a root."""
    axes: Axes
    """What the source gives when nobody says otherwise."""
    drives: tuple[int | None, ...]
    """For each of the 14 rig segments, the joint whose absolute rotation is that segment's; None if unseen, `ROOT` for
    the frame above the root joints. Two segments with one drive are seen as one rigid part."""
    bind: npt.NDArray[np.float64]  # [segment, 4] xyzw, A_j
    noisy: bool = False
    """Whether single frames can flip: then jumps over 120° in one frame count as untracked."""
    quaternion: QuaternionOrder = "xyzw"
    """What the source gives when nobody says otherwise."""

    def __post_init__(self) -> None:
        if len(self.drives) != len(SEGMENTS) or self.bind.shape != (len(SEGMENTS), 4):
            raise ValueError(f"skeleton {self.name!r} must say one drive and one bind rotation per rig segment")
        if len(self.parents) != len(self.joints):
            raise ValueError(f"skeleton {self.name!r} has {len(self.joints)} joints but {len(self.parents)} parents")

    @property
    def sees(self) -> tuple[bool, ...]:
        """For each rig joint, whether this source can observe it at all: [13]."""
        ends = [(self.drives[PARENT_SEGMENT[j]], self.drives[CHILD_SEGMENT[j]]) for j in range(len(JOINTS))]
        return tuple(above is not None and below is not None and above != below for above, below in ends)

    @property
    def needs_local(self) -> bool:
        """Whether only local rotations make sense: without a pelvis joint nothing cancels the sensor's place."""
        return ROOT in self.drives


def define(
    name: str,
    title: str,
    tree: Mapping[str, str | None],
    drives: Mapping[str, str],
    *,
    bind: Mapping[str, npt.NDArray[np.float64]] | None = None,
    axes: Axes = "local",
    quaternion: QuaternionOrder = "xyzw",
    noisy: bool = False,
) -> Skeleton:
    """A skeleton from names: the way the catalogue is written.

    Args:
        name: as in the catalogue.
        title: for people.
        tree: each joint's parent (None for a root), in the order in which the source sends the joints.
        drives: the joint of each rig segment that the source sees.
        bind: A_j [4] xyzw of the segments where it isn't the identity.
        axes: what the source gives when nobody says otherwise.
        quaternion: likewise.
        noisy: whether single frames can flip.
    """
    joints = tuple(tree)
    aligned = np.tile(IDENTITY, (len(SEGMENTS), 1))
    for segment, rotation in (bind or {}).items():
        aligned[SEGMENTS.index(segment)] = rotation
    aligned.setflags(write=False)
    return Skeleton(
        name=name,
        title=title,
        joints=joints,
        parents=tuple(ROOT if parent is None else joints.index(parent) for parent in tree.values()),
        axes=axes,
        drives=tuple(joints.index(drives[segment]) if segment in drives else None for segment in SEGMENTS),
        bind=aligned,
        noisy=noisy,
        quaternion=quaternion,
    )
