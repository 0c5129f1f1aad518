"""The messages of `GET /v1/stream`, as they stand on the wire.

A client opens with `session.start`, then sends frames; the service answers every frame with one estimate. All times are
seconds on the client's clock, all intensities lie in [0, 1] and mean the share of observers expected to recognise the
emotion. Unknown fields are refused, so that a misspelt option is told and not ignored;
in what the service says they are passed over.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel, StringConstraints, model_validator

from fervor.levels import Level
from fervor.protocol.skeleton_spec import MOST_JOINTS, SkeletonSpec
from fervor.skeletons.calibration import HeldPose
from fervor.skeletons.skeleton import Axes, QuaternionOrder

PROTOCOL = "fervor.v1"
"""Name and major version; a subprotocol adds the encoding: `fervor.v1.json`."""

MOST_FRAMES = 4096
"""Frames in one message, whatever the service is set to."""

MOST_LABELS = 64
"""Entries of a probability per emotion."""

BodyId = Annotated[str, StringConstraints(min_length=1, max_length=64)]
"""The client's name for a tracked person, unique in its session."""

EmotionLabel = Annotated[str, StringConstraints(max_length=32)]

Emotion = EmotionLabel | Annotated[dict[EmotionLabel, float], Field(max_length=MOST_LABELS)]
"""A label, or a probability per emotion as face analysers give it."""

Clock = Literal["time", "frames"]
"""`time`: poses are put on the model's grid by their `t`; `frames`: each frame is one step."""

Delivery = Literal["every", "latest"]
"""`every`: one estimate a frame; `latest`: only the newest of a body where several are ready together."""

Memory = Literal["staggered", "stateful", "window"]
"""`staggered`: two states restarted in turn, for streams of any length; `stateful`: one state, as in the paper;
`window`: the last four seconds from a state of zero at every step, exact and costly."""

Status = Literal["warming_up", "ok", "insufficient"]
"""Whether to trust an estimate: too early, yes, or too few joints seen."""

Flag = Literal[
    "between_steps", "interpolated", "held", "gap_reset", "clock_reset", "reset", "late", "duplicate", "jump", "lost"
]
"""What happened to a frame on its way: see docs/reference/protocol.md."""

# Arrays of what a client says are bounded and stop at their first mistake: told one by one, the mistakes of a megabyte
# of nonsense would hold up everybody for seconds.

Joints = Annotated[tuple[str, ...], Field(max_length=MOST_JOINTS, fail_fast=True)]
"""Names of joints."""


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="null")


class _Answer(_Message):
    """What a service says: fields that a newer one adds are passed over, so that clients need not keep pace."""

    model_config = ConfigDict(extra="ignore")


# --- client → service -------------------------------------------------------------------------------------------------


class SessionStart(_Message):
    """Opens the conversation: what the client will send, and what it wants back."""

    type: Literal["session.start"] = "session.start"
    skeleton: str | SkeletonSpec = Field("c13", description="name from /v1/skeletons, or one of your own")
    axes: Axes | None = Field(None, description="default: what the skeleton's sensor gives")
    quaternion: QuaternionOrder | None = Field(None, description="default: what the skeleton's sensor gives")
    joints: Joints | None = Field(None, description="joints sent, in this order; others count as untracked")
    nominal_hz: float | None = Field(None, gt=0, le=1000, description="the sensor's rate; used by clock `frames`")
    clock: Clock = "time"
    delivery: Delivery = "every"
    memory: Memory = "staggered"
    emotion: Emotion | None = Field(None, description="label of new bodies until a frame brings one")
    emotion_ttl_s: float | None = Field(
        None, gt=0, description="seconds a label holds; default: for ever, probabilities 2 s"
    )
    by_emotion: bool = Field(default=False, description="estimates carry the intensity under every emotion too")
    checkpoint_s: float | None = Field(
        None, ge=0.1, description="seconds between the checkpoints of a body, client clock; absent: none are sent"
    )
    resume: tuple[str, ...] = Field(
        (), max_length=64, fail_fast=True, description="checkpoint tokens to go on from, one a body"
    )


Quaternion = Annotated[tuple[float, float, float, float], Field(description="zero or null means untracked")]


Vector = tuple[float, float, float]

Quaternions = Annotated[tuple[Quaternion | None, ...], Field(max_length=MOST_JOINTS, fail_fast=True)]
"""One a joint."""

Vectors = Annotated[tuple[Vector | None, ...], Field(max_length=MOST_JOINTS, fail_fast=True)]
"""One a joint."""

Mask = Annotated[tuple[bool, ...], Field(max_length=MOST_JOINTS, fail_fast=True)]
"""One a joint: whether it is tracked."""


class Raw(RootModel[bytes]):
    """Joints as little-endian float32, one after the other; MessagePack only. Untracked: zeros in q, NaN in p."""

    model_config = ConfigDict(frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _only_bytes(cls, value: object) -> object:
        if not isinstance(value, bytes):
            raise ValueError("expected an array of joints")  # noqa: TRY004  # pydantic tells ValueErrors as complaints
        return value


class Frame(_Message):
    """One timestamped pose of one body."""

    type: Literal["frame"] = "frame"
    body: BodyId = "0"
    seq: int = Field(ge=0, le=2**53, description="rises by one or more from frame to frame")
    t: float | None = Field(None, allow_inf_nan=False, description="seconds, client clock; needed by clock `time`")
    q: Quaternions | Raw | None = Field(None, description="one quaternion a joint; null where untracked")
    p: Vectors | Raw | None = Field(
        None, description="landmark sensors, in place of q: one position a joint, right-handed, any unit"
    )
    mask: Mask | None = Field(None, description="false where untracked")
    emotion: Emotion | None = Field(None, description="a new label; absent: the old one holds; `unknown` clears it")


class Frames(_Message):
    """Several frames in one message, answered by one `estimates`."""

    type: Literal["frames"] = "frames"
    frames: tuple[Frame, ...] = Field(min_length=1, max_length=MOST_FRAMES, fail_fast=True)


class BodyReset(_Message):
    """Forget what a body did so far; its next frame is a first one."""

    type: Literal["body.reset"] = "body.reset"
    body: BodyId


class BodyEnd(_Message):
    """A body is gone; its state is freed."""

    type: Literal["body.end"] = "body.end"
    body: BodyId


class SessionCalibrate(_Message):
    """Takes the alignment of an unknown sensor from a pose that a body holds from its next frame on."""

    type: Literal["session.calibrate"] = "session.calibrate"
    body: BodyId = "0"
    pose: HeldPose = Field("n", description="`n`: arms hanging; `t`: arms straight out to the sides")
    seconds: float = Field(1.0, ge=0.2, le=10.0, description="how long the pose is held, client clock")
    up: Vector = Field((0.0, 1.0, 0.0), description="the person's up in sensor axes")
    forward: Vector = Field((0.0, 0.0, 1.0), description="the way the person faces, in sensor axes")
    name: str | None = Field(None, min_length=1, max_length=64, description="for the skeleton that comes back")


class Ping(_Message):
    """Asks for a pong, through the same queue as frames' errors."""

    type: Literal["ping"] = "ping"
    id: str | None = None


class SessionEnd(_Message):
    """No more frames; the service answers what is under way, then `session.ended`."""

    type: Literal["session.end"] = "session.end"


ClientMessage = Annotated[
    SessionStart | Frame | Frames | BodyReset | BodyEnd | SessionCalibrate | Ping | SessionEnd,
    Field(discriminator="type"),
]


# --- service → client -------------------------------------------------------------------------------------------------


class ModelInfo(_Answer):
    """The model that will answer."""

    name: str
    version: str
    purpose: Literal["demo", "research"] = Field(description="`demo`: procedural training data, not science")
    sha256: str
    rate_hz: float
    emotions: tuple[str, ...]
    thresholds: Mapping[str, float]


class Limits(_Answer):
    """What the service takes from one session; more is refused with an error."""

    max_message_bytes: int = 1_048_576
    max_bodies: int = 16
    max_frames_per_message: int = 1024
    max_frames_per_second: float = 2000.0
    max_joints: int = MOST_JOINTS
    max_unanswered_frames: int = 4096
    max_unsent_bytes: int = 4_194_304
    start_timeout_s: float = 10.0
    idle_timeout_s: float = 60.0
    body_idle_s: float = 10.0


class Resumed(_Answer):
    """A body that goes on from a checkpoint."""

    body: str
    seq: int = Field(description="newest frame that the checkpoint knows; replay those after it")
    same_runtime: bool = Field(description="estimates will be equal to the bit; else to 1e-6")


class SessionStarted(_Answer):
    """The answer to `session.start`."""

    type: Literal["session.started"] = "session.started"
    session_id: str
    protocol: str = PROTOCOL
    model: ModelInfo
    limits: Limits
    joints: tuple[str, ...] = Field(description="joints expected in every frame, in this order")
    fingerprint: str = Field(description="runtime whose estimates are equal to the bit")
    resumed: tuple[Resumed, ...] = ()


class Estimate(_Answer):
    """The answer to one frame."""

    type: Literal["estimate"] = "estimate"
    body: str
    seq: int
    t: float
    intensity: float | None = Field(
        description="share of observers expected to recognise the emotion; null: no pose yet"
    )
    level: Level | None
    emotion: str = Field(description="the label in force, or `unknown`")
    status: Status | str  # a newer service may know more of both
    flags: tuple[Flag | str, ...] = ()
    by_emotion: Mapping[str, float] | None = None


class Estimates(_Answer):
    """The answer to `frames`."""

    type: Literal["estimates"] = "estimates"
    estimates: tuple[Estimate, ...]


class Checkpoint(_Answer):
    """Everything needed to go on with a body after its frame `seq`, on any service with the same key."""

    type: Literal["checkpoint"] = "checkpoint"
    body: str
    seq: int
    token: str = Field(description="signed; keep it as it is")


class SessionCalibrated(_Answer):
    """The answer to `session.calibrate`: in force from the next frame on; `session.start` takes it again."""

    type: Literal["session.calibrated"] = "session.calibrated"
    skeleton: SkeletonSpec
    frames: int
    spread_deg: float = Field(description="largest deviation of a segment from its mean, degrees")
    unseen: tuple[str, ...] = Field(description="segments that were never tracked; they keep their alignment")
    checkpoints: tuple[Checkpoint, ...] = Field(
        default=(), description="of each body under the new alignment, if asked for; those before are void"
    )


class GoingAway(_Answer):
    """The service stops: last checkpoints follow, then it closes with 1012. Connect again and resume."""

    type: Literal["going_away"] = "going_away"
    seconds: float = Field(description="time until the service closes at the latest")


class Pong(_Answer):
    """The answer to `ping`."""

    type: Literal["pong"] = "pong"
    id: str | None = None


class Error(_Answer):
    """A sentence on what went wrong; after a fatal one the service closes."""

    type: Literal["error"] = "error"
    code: str
    message: str
    fatal: bool
    body: str | None = None
    seq: int | None = None
    retry_after: float | None = None


class Totals(_Answer):
    """What a session came to."""

    frames: int = 0
    estimates: int = 0
    late: int = 0
    duplicate: int = 0
    rejected: int = 0
    resets: int = 0


class SessionEnded(_Answer):
    """The last message of a conversation."""

    type: Literal["session.ended"] = "session.ended"
    reason: str
    totals: Totals


ServerMessage = Annotated[
    SessionStarted | Estimate | Estimates | SessionCalibrated | Checkpoint | GoingAway | Pong | Error | SessionEnded,
    Field(discriminator="type"),
]
