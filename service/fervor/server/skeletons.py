"""`GET /v1/skeletons`: the sensors that sessions can name, and what each one sends and sees."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends
from pydantic import BaseModel, Field

from fervor.server.problems import problem_responses
from fervor.server.service import Service, service_of
from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.landmarks import LANDMARKS, Landmarks
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.skeleton import Axes, QuaternionOrder, Skeleton

router = APIRouter(prefix="/v1", tags=["skeletons"])


class SkeletonInfo(BaseModel):
    """One kind of sensor or file."""

    name: str = Field(description="for `session.start` and `/v1/score`")
    title: str
    sends: Literal["rotations", "positions"] = Field(description="in `q` or in `p` of a frame")
    joints: tuple[str, ...] = Field(description="in the order in which a frame has them")
    parents: tuple[int, ...] | None = Field(None, description="index of each joint's parent; -1 for a root")
    axes: Axes | None = Field(None, description="of the rotations, unless the session says otherwise")
    quaternion: QuaternionOrder | None = Field(None, description="order, unless the session says otherwise")
    noisy: bool = Field(description="jumps over 120° in one frame count as untracked")
    unseen: tuple[str, ...] = Field(description="joints of the rig C13 that it can't observe; they are masked")


@router.get("/skeletons", responses=problem_responses(401, 403))
async def skeletons(service: Annotated[Service, Depends(service_of)]) -> list[SkeletonInfo]:
    """The catalogue, and the calibrations kept on this service."""
    known: dict[str, Skeleton | Landmarks] = {**SKELETONS, **LANDMARKS, **service.host.skeletons}
    return [describe_skeleton(name, source) for name, source in known.items()]


def describe_skeleton(name: str, source: Skeleton | Landmarks) -> SkeletonInfo:
    """A source, as clients are told of it."""
    unseen = tuple(joint for joint, seen in zip(JOINTS, source.sees, strict=True) if not seen)
    common = {"name": name, "title": source.title, "joints": source.joints, "noisy": source.noisy, "unseen": unseen}
    if isinstance(source, Landmarks):
        return SkeletonInfo(sends="positions", **common)
    return SkeletonInfo(
        sends="rotations", parents=source.parents, axes=source.axes, quaternion=source.quaternion, **common
    )
