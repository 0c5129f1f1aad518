"""A skeleton as JSON: how a client brings its own, and how a calibration is kept."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from fervor.errors import InputError
from fervor.rotations import IDENTITY, normalise
from fervor.skeletons.binds import Quaternion
from fervor.skeletons.rig import SEGMENTS
from fervor.skeletons.skeleton import ROOT, Axes, QuaternionOrder, Skeleton

MOST_JOINTS = 256
"""More joints than any body tracker gives; a longer list is a mistake."""

Numbers4 = tuple[float, float, float, float]


class SkeletonSpec(BaseModel):
    """A joint tree, which joint drives which segment of the rig, and its alignment."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str = Field(min_length=1, max_length=64)
    title: str = ""
    joints: tuple[str, ...] = Field(
        min_length=1, max_length=MOST_JOINTS, fail_fast=True, description="in the order they are sent"
    )
    parents: tuple[int, ...] = Field(
        max_length=MOST_JOINTS, fail_fast=True, description="index of each joint's parent; -1 for a root"
    )
    segments: dict[str, str] = Field(description="rig segment → the joint whose absolute rotation is that segment's")
    bind: dict[str, Numbers4] = Field(
        default_factory=dict, description="rig segment → alignment A, xyzw; identity where absent"
    )
    axes: Axes = "local"
    quaternion: QuaternionOrder = "xyzw"
    noisy: bool = Field(default=False, description="reject jumps over 120° in one frame")

    @model_validator(mode="after")
    def _fits_together(self) -> "SkeletonSpec":
        if len(self.parents) != len(self.joints):
            raise ValueError(f"{len(self.joints)} joints have {len(self.parents)} parents; expected one each")
        if len(set(self.joints)) != len(self.joints):
            raise ValueError("a joint is named twice; expected each once")
        for segment, joint in self.segments.items():
            if segment not in SEGMENTS or joint not in self.joints:
                raise ValueError(
                    f"segments maps {segment!r} to {joint!r}; expected a rig segment and one of the joints"
                )
        for segment, rotation in self.bind.items():
            if segment not in SEGMENTS or not 0.5 <= float(np.sqrt(sum(x * x for x in rotation))) <= 2.0:
                raise ValueError(
                    f"bind of {segment!r} is {list(rotation)}; expected a rig segment and a unit quaternion"
                )
        self._check_tree()
        return self

    def _check_tree(self) -> None:
        for joint in range(len(self.parents)):
            seen, at = 0, joint
            while at != ROOT:
                if not 0 <= at < len(self.parents) or seen > len(self.parents):
                    raise ValueError(f"the parents of joint {self.joints[joint]!r} never reach a root (-1)")
                seen, at = seen + 1, self.parents[at]

    def to_skeleton(self) -> Skeleton:
        """The skeleton itself."""
        bind = np.tile(IDENTITY, (len(SEGMENTS), 1))
        for segment, rotation in self.bind.items():
            bind[SEGMENTS.index(segment)] = _unit(np.array(rotation, np.float64))
        bind.setflags(write=False)
        return Skeleton(
            name=self.name,
            title=self.title or self.name,
            joints=self.joints,
            parents=self.parents,
            axes=self.axes,
            drives=tuple(
                self.joints.index(self.segments[segment]) if segment in self.segments else None for segment in SEGMENTS
            ),
            bind=bind,
            noisy=self.noisy,
            quaternion=self.quaternion,
        )

    @classmethod
    def of(cls, skeleton: Skeleton, *, name: str | None = None) -> "SkeletonSpec":
        """The JSON form of a skeleton.

        Raises:
            InputError: a skeleton without a pelvis joint, such as c13, has none; name it instead.
        """
        if skeleton.needs_local:
            raise InputError(f"skeleton {skeleton.name!r} has no pelvis joint and no JSON form; expected its name")
        driven = {segment: joint for segment, joint in zip(SEGMENTS, skeleton.drives, strict=True) if joint is not None}
        bind = {segment: skeleton.bind[SEGMENTS.index(segment)].tolist() for segment in driven}
        return cls(
            name=name or skeleton.name,
            title=skeleton.title,
            joints=skeleton.joints,
            parents=skeleton.parents,
            segments={segment: skeleton.joints[joint] for segment, joint in driven.items()},
            bind={segment: (a, b, c, d) for segment, (a, b, c, d) in bind.items()},
            axes=skeleton.axes,
            quaternion=skeleton.quaternion,
            noisy=skeleton.noisy,
        )


def _unit(rotation: Quaternion) -> Quaternion:
    """At unit length; one that is there already keeps its bits, so that JSON loses none."""
    return rotation if abs(float(np.sum(rotation * rotation)) - 1.0) < 1e-12 else normalise(rotation)
