"""What is scored."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.session.body import Terms
from fervor.session.events import Source
from fervor.session.label import NO_LABEL, Label, make_label


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """Frames of one body in the order of its source's joints."""

    name: str
    times: npt.NDArray[np.float64]  # [frame] seconds
    rotations: npt.NDArray[np.float64]  # [frame, joint, 4] xyzw, or [frame, joint, 3] positions of landmarks
    observed: npt.NDArray[np.bool_]  # [frame, joint]
    emotion: str | Mapping[str, float] | None = None
    source: Source | None = None
    """Its own; absent: that of the terms."""

    def __len__(self) -> int:
        return len(self.times)

    def label(self, terms: Terms) -> Label:
        """The label of its first frame.

        Raises:
            InputError: an emotion that is not known.
        """
        if self.emotion is None:
            return NO_LABEL
        return make_label(self.emotion, float(self.times[0]) if len(self) else 0.0, terms.emotion_ttl_s)
