"""What a caller can ask for, as the `session.start` that opens the conversation."""

from collections.abc import Mapping, Sequence
from typing import TypedDict

from pydantic import ValidationError

from fervor.errors import InputError
from fervor.protocol.codec import one_sentence
from fervor.protocol.messages import Clock, Delivery, Emotion, Memory, SessionCalibrate, SessionStart, Vector
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.skeletons.calibration import HeldPose
from fervor.skeletons.skeleton import Axes, QuaternionOrder


class Options(TypedDict, total=False):
    """What a session can be asked for beside skeleton and emotion; the service's default where absent."""

    axes: Axes
    """`local` or `global` rotations; default: what the skeleton's sensor gives."""
    quaternion: QuaternionOrder
    """Order of a quaternion's numbers; default: what the skeleton's sensor gives."""
    joints: Sequence[str]
    """The joints of every pose, in this order; others count as untracked."""
    nominal_hz: float
    """The sensor's rate, for clock `frames`."""
    clock: Clock
    """`time` (default): poses are put on the model's grid by their times; `frames`: each is one step."""
    delivery: Delivery
    """`every` (default): one estimate a frame; `latest`: only the newest where several are ready."""
    memory: Memory
    """`staggered` (default): for streams of any length; `stateful`: one state, as in the paper."""
    emotion_ttl_s: float
    """Seconds a label holds; default: for ever, probabilities 2 s."""
    by_emotion: bool
    """Estimates carry the intensity under every emotion too."""
    checkpoint_s: float
    """Seconds between the checkpoints of a body, client clock; 1 where a session resumes, else none come."""


class Held(TypedDict, total=False):
    """How a body holds still for a calibration; see `session.calibrate` in the protocol for the defaults."""

    body: str
    pose: HeldPose
    """`n` (default): arms hanging; `t`: arms straight out to the sides."""
    seconds: float
    """How long the pose is held."""
    up: Vector
    """The person's up in sensor axes."""
    forward: Vector
    """The way the person faces, in sensor axes."""
    name: str
    """For the skeleton that comes back."""


def calibration(held: Held) -> SessionCalibrate:
    """The `session.calibrate` for what a caller asks.

    Raises:
        InputError: an impossible value.
    """
    try:
        return SessionCalibrate.model_validate(held)
    except ValidationError as error:
        raise InputError(one_sentence(error)) from None


CHECKPOINT_S = 1.0
"""Default of `checkpoint_s` where a session resumes."""


def opening(
    skeleton: str | SkeletonSpec,
    emotion: str | Mapping[str, float] | None,
    options: Options,
    *,
    resume: bool = False,
) -> SessionStart:
    """The `session.start` for what a caller asks; one that can `resume` asks for checkpoints.

    Raises:
        InputError: an option that the protocol doesn't have, or an impossible value.
    """
    asked = {"skeleton": skeleton, "emotion": wire_emotion(emotion), "checkpoint_s": CHECKPOINT_S if resume else None}
    try:
        return SessionStart.model_validate({**asked, **options})
    except ValidationError as error:
        raise InputError(one_sentence(error)) from None


def wire_emotion(emotion: str | Mapping[str, float] | None) -> Emotion | None:
    """A label or a probability per emotion as messages have it."""
    return emotion if emotion is None or isinstance(emotion, str) else dict(emotion)
