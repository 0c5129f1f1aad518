"""One example of every message, for the AsyncAPI document; being made of the models, none can be out of date."""

from typing import get_args

from pydantic import BaseModel

from fervor.levels import Level
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Checkpoint,
    ClientMessage,
    Error,
    Estimate,
    Estimates,
    Frame,
    Frames,
    GoingAway,
    Limits,
    ModelInfo,
    Ping,
    Pong,
    Resumed,
    ServerMessage,
    SessionCalibrate,
    SessionCalibrated,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor.protocol.skeleton_spec import SkeletonSpec

_JOINTS = ("spine", "chest", "head")
_POSE = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.1, 0.0, 0.995), None)
_FRAME = Frame(body="ann", seq=41, t=12.5, q=_POSE, emotion={"joy": 0.8, "surprise": 0.1})
_ESTIMATE = Estimate(
    body="ann", seq=41, t=12.5, intensity=0.43, level=Level.WEAK, emotion="joy", status="ok", flags=("interpolated",)
)
_SKELETON = SkeletonSpec(
    name="my-sensor",
    joints=("hips", "back", "skull"),
    parents=(-1, 0, 1),
    segments={"pelvis": "hips", "thorax": "back", "head": "skull"},
    axes="global",
)
_MODEL = ModelInfo(
    name="fervor-demo",
    version="0.1.0",
    purpose="demo",
    sha256="da1c" * 16,
    rate_hz=30.0,
    emotions=("anger", "joy"),
    thresholds={"anger": 0.5, "joy": 0.5, "unknown": 0.5},
)
_MESSAGES: tuple[BaseModel, ...] = (
    SessionStart(joints=_JOINTS, emotion="joy", checkpoint_s=1.0, resume=("dG9rZW4=",)),
    _FRAME,
    Frames(frames=(_FRAME, Frame(body="bob", seq=7, t=12.5, q=_POSE))),
    BodyReset(body="ann"),
    BodyEnd(body="ann"),
    SessionCalibrate(body="ann", pose="n", seconds=2.0),
    Ping(id="7"),
    SessionEnd(),
    SessionStarted(
        session_id="29e71d0489edaeee",
        model=_MODEL,
        limits=Limits(),
        joints=_JOINTS,
        fingerprint="8759521bd3df12d1",
        resumed=(Resumed(body="ann", seq=40, same_runtime=True),),
    ),
    _ESTIMATE,
    Estimates(estimates=(_ESTIMATE,)),
    SessionCalibrated(
        skeleton=_SKELETON,
        frames=61,
        spread_deg=1.5,
        unseen=(),
        checkpoints=(Checkpoint(body="ann", seq=61, token="dG9rZW4="),),  # noqa: S106  # likewise
    ),
    Checkpoint(body="ann", seq=41, token="dG9rZW4="),  # noqa: S106  # a token of nothing
    GoingAway(seconds=5.0),
    Pong(id="7"),
    Error(
        code="bad_frame",
        message="frame 42 of body 'ann' has 2 joints in q; expected 3",
        fatal=False,
        body="ann",
        seq=42,
    ),
    SessionEnded(reason="ended by the client", totals=Totals(frames=42, estimates=42)),
)

EXAMPLES = {type(message): message for message in _MESSAGES}
"""By the kind of message."""

assert EXAMPLES.keys() == {*get_args(get_args(ClientMessage)[0]), *get_args(get_args(ServerMessage)[0])}
