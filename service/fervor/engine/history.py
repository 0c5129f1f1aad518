"""The last poses of a body with memory `window`."""

from dataclasses import dataclass

import numpy as np

from fervor.model import Floats
from fervor.skeletons.rig import JOINTS


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """Canonical poses on the grid, oldest first."""

    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]

    def __len__(self) -> int:
        return len(self.rotations)

    def then(self, rotations: Floats, mask: Floats, most: int) -> "History":
        """One more pose ([joint, 4], [joint]), and at most `most` in all."""
        keep = slice(max(len(self) + 1 - most, 0), None)
        return History(
            np.concatenate([self.rotations[keep], rotations[None]]), np.concatenate([self.mask[keep], mask[None]])
        )


NO_HISTORY = History(np.zeros((0, len(JOINTS), 4), np.float32), np.zeros((0, len(JOINTS)), np.float32))
"""A body that has not been seen yet."""
