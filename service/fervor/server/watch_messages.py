"""What a watcher of the live page and the service say to each other, as JSON text messages.

A watcher asks with `look` for what it wants to see, any time; the service says `watch.started` once, then a `snapshot`
several times a second. Words are those of the stream; poses are the rig's, whatever a session sends.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from fervor.levels import Level
from fervor.protocol.messages import BodyId, ModelInfo

MOST_SHOWN = 12
"""Bodies in one snapshot, so that a watcher of a full service costs no more than one of twelve robots."""

MOST_SESSIONS = 64
"""Sessions that a snapshot lists; beyond, they are only counted."""

SUBPROTOCOL = "fervor.watch.v1.json"


Point = tuple[float, float, float]


class BodyName(BaseModel):
    """A body of a session."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    session: str = Field(max_length=64)
    body: BodyId


class Look(BaseModel):
    """What a watcher wants to see; the newest counts."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["look"] = "look"
    first: int = Field(0, ge=0, le=1_000_000, description="how many bodies are passed over")
    by_emotion: Annotated[tuple[BodyName, ...], Field(max_length=MOST_SHOWN, fail_fast=True)] = Field(
        (), description="bodies whose intensity under every emotion is wanted too"
    )


class _Told(BaseModel):
    model_config = ConfigDict(frozen=True)


class WatchStarted(_Told):
    """What holds as long as the service runs."""

    type: Literal["watch.started"] = "watch.started"
    version: str = Field(description="of the service")
    model: ModelInfo
    hysteresis: float = Field(description="half-width of the band about a threshold in which the level stays")
    joints: tuple[str, ...] = Field(description="of the rig, in the order of `q`")
    parents: tuple[int, ...] = Field(description="index of each joint's parent; -1 is the pelvis")
    pelvis: Point = Field(description="of a standing body on the ground, metres; X its left, Y up, Z forward")
    offsets: tuple[Point, ...] = Field(description="of each joint from its parent in the standard body, metres")
    tips: tuple[Point | None, ...] = Field(description="where the body ends beyond a joint, metres; null: at another")
    workers: int = Field(description="processes of the service; a snapshot shows the sessions of one")
    rate_hz: float = Field(description="snapshots a second at most")


class SeenSession(_Told):
    """A session."""

    session: str
    skeleton: str | None = Field(description="of its sensor; null before `session.start`")
    bodies: int = Field(description="followed now")
    frames: int = Field(description="taken so far")


class SeenBody(_Told):
    """A body as it is now: its newest estimate, and its pose."""

    session: str
    body: str
    seq: int = Field(description="of the newest frame that was answered")
    t: float = Field(description="of that frame, seconds, client clock")
    intensity: float | None
    level: Level | None
    emotion: str
    status: str
    flags: tuple[str, ...]
    threshold: float = Field(description="of the emotion in force: intensity from here on is strong")
    q: list[list[float]] = Field(description="local rotations of the rig, xyzw; what is not observed holds its last")
    observed: list[bool] = Field(description="one a joint")
    by_emotion: dict[str, float] | None = Field(description="where it was asked for")


class Snapshot(_Told):
    """What the service sees now."""

    type: Literal["snapshot"] = "snapshot"
    sessions: tuple[SeenSession, ...] = Field(description=f"the oldest {MOST_SESSIONS}")
    sessions_total: int
    bodies: tuple[SeenBody, ...] = Field(description=f"{MOST_SHOWN} at most, from `first` on")
    bodies_total: int
    first: int = Field(description="how many were passed over: as asked, or fewer where there are not so many")
