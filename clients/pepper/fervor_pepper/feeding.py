"""Where `fervor-pepper` takes poses from: a recording, or lines of JSON that another program writes."""

import threading
import time
from collections.abc import Callable, Iterable
from typing import TextIO

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fervor.cli.playing import TimedPose
from fervor.errors import FervorError, FrameError, InputError
from fervor.protocol.codec import one_sentence
from fervor.protocol.messages import BodyId, Emotion
from fervor_pepper.companion import Companion


class FrameLine(BaseModel):
    """One line: a pose of one body, or that it is gone."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    body: BodyId = "0"
    t: float | None = Field(None, allow_inf_nan=False, description="seconds on the sensor's clock; now if absent")
    q: tuple[tuple[float, float, float, float] | None, ...] | None = Field(
        None, description="a quaternion a joint; null where untracked"
    )
    p: tuple[tuple[float, float, float] | None, ...] | None = Field(
        None, description="landmark sensors, in place of q: a position a joint"
    )
    emotion: Emotion | None = Field(None, description="a new label; the old one holds if absent")
    gone: bool = Field(default=False, description="true: the body is gone; no pose is needed")


def play(companion: Companion, frames: Iterable[TimedPose]) -> None:
    """Feed a recording at its own pace."""
    begun, never = time.monotonic(), threading.Event()
    first: float | None = None
    for t, pose in frames:
        first = t if first is None else first
        # Due times are counted from the beginning, so that a late frame does not delay those after it.
        never.wait(max(begun + t - first - time.monotonic(), 0.0))
        companion.feed(pose, t=t)


def relay(companion: Companion, lines: TextIO, *, complain: Callable[[FervorError], None]) -> None:
    """Feed what another program writes, one `FrameLine` a line, until it ends; a bad line harms itself alone."""
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            _feed_line(companion, line)
        except (ValidationError, InputError) as error:
            sentence = one_sentence(error) if isinstance(error, ValidationError) else error.message
            complain(FrameError(f"line {number}: {sentence.replace('this message', 'a frame line')}"))


def _feed_line(companion: Companion, line: str) -> None:
    frame = FrameLine.model_validate_json(line)
    if frame.gone:
        companion.leave(frame.body)
        return
    pose = frame.q if frame.q is not None else frame.p
    if pose is None:
        raise FrameError("a frame needs q or p, one entry a joint")
    companion.feed(list(pose), frame.emotion, body=frame.body, t=frame.t)
