"""The answers to a body's newest frames, kept so that a frame that comes twice gets the same answer twice.

Which frames are remembered follows from the frames alone, never from how far the engine has come: the newest
`REMEMBERED` numbers in the order in which they came, answered or still under way. Each answer is kept as the bytes that
a checkpoint has of it: those are needed every second, the answer itself hardly ever.
"""

from collections import deque
from collections.abc import Iterable

import msgspec

from fervor.emotions import EMOTIONS
from fervor.errors import CheckpointUnknown
from fervor.levels import Level
from fervor.protocol.lean_estimate import LeanEstimate
from fervor.protocol.messages import Flag, Status

REMEMBERED = 64
"""Frames of a body whose answer is kept."""


class _Kept(msgspec.Struct, array_like=True, frozen=True, gc=False):
    """An estimate without its body's name; floats are float64 there and here."""

    seq: int
    t: float
    intensity: float | None
    level: Level | None
    emotion: str
    status: Status
    flags: tuple[Flag, ...]
    by_emotion: tuple[float, ...] | None  # [emotion]


_encode = msgspec.msgpack.Encoder().encode
_decode = msgspec.msgpack.Decoder(_Kept).decode


class Answers:
    """What one body was answered, and which of its frames are under way."""

    __slots__ = ("_body", "_given", "_newest", "_under_way")

    def __init__(self, body: str) -> None:
        self._body = body
        self._newest: deque[int] = deque(maxlen=REMEMBERED)  # seqs, as planned
        self._under_way: dict[int, int] = {}  # seq → tickets
        self._given: deque[bytes] = deque(maxlen=REMEMBERED)  # answers, oldest first

    def expect(self, seq: int, *, new: bool = False) -> bool:
        """A frame comes; whether another one of this number is still under way, whose answer it shares.

        Args:
            seq: its number.
            new: no frame had this number before.
        """
        tickets = 0 if new else self._under_way.get(seq, 0)
        if tickets and seq in self._newest:
            return True
        self._under_way[seq] = tickets + 1
        self._newest.append(seq)
        return False

    @property
    def any(self) -> bool:
        """Whether anything was answered."""
        return bool(self._given)

    @property
    def newest(self) -> LeanEstimate | None:
        """What was answered last; None before the first answer."""
        return self._estimate(_decode(self._given[-1])) if self._given else None

    def find(self, seq: int) -> LeanEstimate | None:
        """The answer that a frame of this number got; None if it is under way, forgotten or never came."""
        return self.given(seq) if seq in self._newest else None

    def give(self, estimate: LeanEstimate) -> None:
        """A frame is answered; in the order in which they came."""
        seq, shares = estimate.seq, estimate.by_emotion
        self._conclude(seq)
        self._given.append(
            _encode(  # the fields of `_Kept`, in their order
                (
                    seq,
                    estimate.t,
                    estimate.intensity,
                    estimate.level,
                    estimate.emotion,
                    estimate.status,
                    estimate.flags,
                    None if shares is None else tuple(shares.values()),
                )
            )
        )

    def given(self, seq: int) -> LeanEstimate | None:
        """The answer to a frame that another one shares; None if that failed."""
        newest_first = map(_decode, reversed(self._given))  # a search is as rare as a frame that comes twice
        return next((self._estimate(kept) for kept in newest_first if kept.seq == seq), None)

    def fail(self, seq: int) -> None:
        """A frame gets no answer; the same number may come again."""
        self._conclude(seq)
        if seq in self._newest:
            self._newest.remove(seq)

    def _conclude(self, seq: int) -> None:
        left = self._under_way.pop(seq, 1) - 1  # 1: of a frame that was to share an answer which never came
        if left:
            self._under_way[seq] = left

    def to_bytes(self) -> tuple[bytes, ...]:
        """All that was answered, oldest first; no bit is lost."""
        return tuple(self._given)

    @classmethod
    def from_bytes(cls, body: str, kept: Iterable[bytes]) -> "Answers":
        """What `to_bytes` gave.

        Raises:
            CheckpointUnknown: bytes of something else.
        """
        answers = cls(body)
        for each in kept:
            try:
                answers._newest.append(_decode(each).seq)
            except (msgspec.DecodeError, UnicodeError):
                raise CheckpointUnknown(
                    "the checkpoint can't be read; expected a token as the service sent it"
                ) from None
            answers._given.append(each)
        return answers

    def _estimate(self, kept: _Kept) -> LeanEstimate:
        shares = kept.by_emotion
        return LeanEstimate(
            body=self._body,
            seq=kept.seq,
            t=kept.t,
            intensity=kept.intensity,
            level=kept.level,
            emotion=kept.emotion,
            status=kept.status,
            flags=kept.flags,
            by_emotion=None if shares is None else dict(zip(EMOTIONS, shares, strict=True)),
        )
