"""A scored take: its estimates in columns, as they are computed; made into messages only where those are asked for."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor.levels import Level
from fervor.protocol.lean_estimate import LeanEstimate
from fervor.protocol.messages import Estimate
from fervor.protocol.trusted import trusted


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """One estimate a frame."""

    name: str
    times: npt.NDArray[np.float64]  # [frame] seconds
    intensity: npt.NDArray[np.float64]  # [frame] NaN before the first pose
    by_emotion: npt.NDArray[np.float64] | None  # [frame, emotion]; None where it is not wanted
    levels: Sequence[Level | None]
    emotions: Sequence[str]
    statuses: Sequence[str]
    """A `Status` each."""
    flags: Sequence[tuple[str, ...]]
    """Any `Flag` each."""

    def __len__(self) -> int:
        return len(self.times)

    def estimates(self) -> list[Estimate]:
        """The messages that a stream would have got."""
        intensities = [None if isnan(value) else value for value in self.intensity.tolist()]
        columns = (self.times.tolist(), intensities, self.levels, self.emotions, self.statuses, self.flags)
        return [
            trusted(
                Estimate,
                {
                    "type": "estimate",
                    "body": self.name,
                    "seq": seq,
                    "t": time,
                    "intensity": intensity,
                    "level": level,
                    "emotion": emotion,
                    "status": status,
                    "flags": flags,
                    "by_emotion": None if intensity is None else self._shares(seq),
                },
            )
            for seq, (time, intensity, level, emotion, status, flags) in enumerate(zip(*columns, strict=True))
        ]

    def _shares(self, frame: int) -> dict[str, float] | None:
        """The intensity under every emotion, where it is wanted."""
        if self.by_emotion is None:
            return None
        return dict(zip(EMOTIONS, self.by_emotion[frame].tolist(), strict=True))

    @classmethod
    def of(cls, name: str, estimates: Sequence[Estimate | LeanEstimate]) -> "Scored":
        """The columns of one estimate a frame."""
        wanted = any(estimate.by_emotion is not None for estimate in estimates)
        rows = [[(estimate.by_emotion or {}).get(label, np.nan) for label in EMOTIONS] for estimate in estimates]
        return cls(
            name=name,
            times=np.array([estimate.t for estimate in estimates], np.float64),
            intensity=np.array([estimate.intensity for estimate in estimates], np.float64),  # None becomes NaN
            by_emotion=np.array(rows) if wanted else None,
            levels=[estimate.level for estimate in estimates],
            emotions=[estimate.emotion for estimate in estimates],
            statuses=[estimate.status for estimate in estimates],
            flags=[estimate.flags for estimate in estimates],
        )


@dataclass(frozen=True, slots=True)
class Summary:
    """A scored take in a few numbers; intensities over the frames after the warm-up, if there are any."""

    name: str
    emotion: str
    frames: int
    duration_s: float
    mean: float | None
    peak: float | None
    last: float | None
    strong: float
    """Share of the frames with level strong."""
    level: Level | None
    """At the end."""


def summarise(scored: Scored) -> Summary:
    """A few numbers for one scored take."""
    known = ~np.isnan(scored.intensity)
    settled = scored.intensity[known & np.array([status == "ok" for status in scored.statuses], np.bool_)]
    if not len(settled):
        settled = scored.intensity[known]
    frames = len(scored)
    return Summary(
        name=scored.name,
        emotion=scored.emotions[-1] if frames else UNKNOWN,
        frames=frames,
        duration_s=float(scored.times[-1]) - float(scored.times[0]) if frames else 0.0,
        mean=float(np.mean(settled)) if len(settled) else None,
        peak=float(settled.max()) if len(settled) else None,
        last=float(scored.intensity[-1]) if frames and known[-1] else None,
        strong=scored.levels.count(Level.STRONG) / frames if frames else 0.0,
        level=scored.levels[-1] if frames else None,
    )
