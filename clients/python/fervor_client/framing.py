"""Poses as callers give them to frames: numbered per body, timed, checked."""

from collections.abc import Callable, Mapping, Sequence

from pydantic import ValidationError

from fervor.errors import FrameError
from fervor.protocol.codec import one_sentence
from fervor.protocol.messages import Frame
from fervor_client.options import wire_emotion
from fervor_client.poses import Pose, to_joints


class Framer:
    """Makes the frames of one conversation."""

    def __init__(self, now: Callable[[], float]) -> None:
        """`now`: seconds, for frames without a time."""
        self._now = now
        self._next_seq: dict[str, int] = {}
        self._width = 4  # numbers a joint had in the newest pose

    def make(
        self,
        pose: Pose,
        joints: Sequence[str],
        *,
        body: str,
        seq: int | None,
        t: float | None,
        emotion: str | Mapping[str, float] | None,
        mask: Sequence[bool] | None,
    ) -> Frame:
        """A pose of `joints` as a frame; see `Session.send`.

        Raises:
            FrameError: the pose, or one of the others, can't be sent; nothing happened.
        """
        seq = self._next_seq.get(body, 0) if seq is None else seq
        try:
            rows = to_joints(pose, joints, width=self._width)
            frame = Frame(
                body=body,
                seq=seq,
                t=self._now() if t is None else float(t),
                **rows,
                mask=None if mask is None else tuple(bool(seen) for seen in mask),
                emotion=wire_emotion(emotion),
            )
        except ValidationError as error:
            raise FrameError(one_sentence(error), body=body, seq=seq) from None
        except FrameError as error:
            raise FrameError(f"frame {seq} of body {body!r}: {error.message}", body=body, seq=seq) from None
        self._width = 4 if "q" in rows else 3
        return frame

    def count(self, frame: Frame) -> None:
        """The frame is sent: the body's next one gets a higher number."""
        self._next_seq[frame.body] = max(frame.seq + 1, self._next_seq.get(frame.body, 0))
