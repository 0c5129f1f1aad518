"""The answers to a body's newest frames, kept so that a frame that comes twice gets the same answer twice.

Which frames are remembered follows from the frames alone, never from how far the engine has come: the newest
`REMEMBERED` numbers in the order in which they came, answered or still under way.
"""

from collections import Counter, OrderedDict
from collections.abc import Iterable, Mapping
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor.errors import CheckpointUnknown
from fervor.levels import Level
from fervor.protocol.messages import Estimate, Flag, Status

REMEMBERED = 64
"""Frames of a body whose answer is kept."""

Arrays = dict[str, npt.NDArray[np.generic]]

_LEVELS: tuple[Level | None, ...] = (None, *Level)
_LABELS = (*EMOTIONS, UNKNOWN)
_STATUSES: tuple[str, ...] = get_args(Status)
_FLAGS: tuple[str, ...] = get_args(Flag)


class Answers:
    """What one body was answered, and which of its frames are under way."""

    def __init__(self) -> None:
        self._newest: OrderedDict[int, None] = OrderedDict()  # seqs, as planned
        self._under_way: Counter[int] = Counter()
        self._given: OrderedDict[int, Estimate] = OrderedDict()

    def expect(self, seq: int) -> bool:
        """A frame comes; whether another one of this number is still under way, whose answer it shares."""
        if seq in self._newest and self._under_way[seq]:
            return True
        self._under_way[seq] += 1
        self._newest[seq] = None
        if len(self._newest) > REMEMBERED:
            self._newest.popitem(last=False)
        return False

    @property
    def newest(self) -> Estimate | None:
        """What was answered last; None before the first answer."""
        return next(reversed(self._given.values()), None)

    def find(self, seq: int) -> Estimate | None:
        """The answer that a frame of this number got; None if it is under way, forgotten or never came."""
        return self._given.get(seq) if seq in self._newest else None

    def give(self, seq: int, estimate: Estimate) -> None:
        """A frame is answered; in the order in which they came."""
        self._conclude(seq)
        self._given[seq] = estimate
        if len(self._given) > REMEMBERED:
            self._given.popitem(last=False)

    def given(self, seq: int) -> Estimate | None:
        """The answer to a frame that another one shares; None if that failed."""
        return self._given.get(seq)

    def fail(self, seq: int) -> None:
        """A frame gets no answer; the same number may come again."""
        self._conclude(seq)
        self._newest.pop(seq, None)

    def _conclude(self, seq: int) -> None:
        self._under_way[seq] -= 1
        if self._under_way[seq] <= 0:
            del self._under_way[seq]

    def to_arrays(self) -> Arrays:
        """All that was answered, oldest first, as arrays [answer, …] that lose no bit."""
        kept = list(self._given.values())
        by_emotion = [estimate.by_emotion for estimate in kept]
        rows = [[(each or {}).get(name, np.nan) for name in EMOTIONS] for each in by_emotion] if any(by_emotion) else []
        return {
            "seq": np.array([estimate.seq for estimate in kept], np.int64),
            "t": np.array([estimate.t for estimate in kept], np.float64),
            "intensity": np.array([estimate.intensity for estimate in kept], np.float64),  # None becomes nan
            "level": _places((estimate.level for estimate in kept), _LEVELS),
            "emotion": _places((estimate.emotion for estimate in kept), _LABELS),
            "status": _places((estimate.status for estimate in kept), _STATUSES),
            "flags": np.array([_bits(estimate.flags) for estimate in kept], np.uint16),
            "by_emotion": np.array(rows, np.float64).reshape(-1, len(EMOTIONS)),
        }

    @classmethod
    def from_arrays(cls, body: str, arrays: Arrays) -> "Answers":
        """What `to_arrays` gave.

        Raises:
            CheckpointUnknown: arrays of something else.
        """
        answers = cls()
        try:
            columns = {name: array.tolist() for name, array in arrays.items()}
            for row, seq in enumerate(columns["seq"]):
                answers._newest[seq] = None
                answers._given[seq] = _estimate(body, columns, row)
        except (KeyError, IndexError, TypeError, ValueError):
            raise CheckpointUnknown("the checkpoint can't be read; expected a token as the service sent it") from None
        return answers


def _estimate(body: str, columns: Mapping[str, Any], row: int) -> Estimate:
    intensity = columns["intensity"][row]
    none = bool(np.isnan(intensity))
    shares = None if none or not columns["by_emotion"] else columns["by_emotion"][row]
    return Estimate(
        body=body,
        seq=columns["seq"][row],
        t=columns["t"][row],
        intensity=None if none else intensity,
        level=_LEVELS[columns["level"][row]],
        emotion=_LABELS[columns["emotion"][row]],
        status=_STATUSES[columns["status"][row]],
        flags=tuple(flag for bit, flag in enumerate(_FLAGS) if columns["flags"][row] >> bit & 1),
        by_emotion=None if shares is None else dict(zip(EMOTIONS, shares, strict=True)),
    )


def _places(values: Iterable[str | None], among: tuple[str | None, ...]) -> npt.NDArray[np.uint8]:
    return np.array([among.index(value) for value in values], np.uint8)


def _bits(flags: Iterable[str]) -> int:
    return sum(1 << _FLAGS.index(flag) for flag in flags)
