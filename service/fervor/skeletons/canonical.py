"""The rig C13 as a source: clients that already have canonical local rotations.

It has no pelvis joint; spine and hips are relative to the pelvis, which is therefore `ROOT`, and only local rotations
make sense.
"""

import numpy as np

from fervor.rotations import identity
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENTS, SEGMENTS
from fervor.skeletons.skeleton import ROOT, Skeleton

C13 = Skeleton(
    name="c13",
    title="Canonical rig C13 (13 joints)",
    joints=JOINTS,
    parents=PARENTS,
    axes="local",
    drives=tuple(CHILD_SEGMENT.index(s) if s in CHILD_SEGMENT else ROOT for s in range(len(SEGMENTS))),
    bind=identity((len(SEGMENTS),), np.float64),
)
"""The identity: what goes in comes out."""
