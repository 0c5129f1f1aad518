"""The parameters of the node: what there is, and their values as settings that hold together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast, get_args

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor.errors import InputError
from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.ros4hri import ROS4HRI
from fervor.skeletons.skeleton import Axes, Skeleton
from fervor_client import DEFAULT_URL
from fervor_ros.topics import Source

Value = str | float | bool | list[str]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter."""

    name: str
    default: Value
    description: str
    choices: tuple[str, ...] = ()
    most: float | None = None
    """Where it is a number, which is never negative."""


PARAMETERS = (
    Parameter("service", DEFAULT_URL, "Where the service is; a token for it is read from FERVOR_TOKEN."),
    Parameter("source", "joint_states", "Where poses come from.", get_args(Source)),
    Parameter("skeleton", ROS4HRI.name, "The joints of joint_rotations; else poses are ROS4HRI's.", tuple(SKELETONS)),
    Parameter(
        "axes", "", "Whether joint_rotations are relative to the parent joint; empty: as the skeleton's sensor gives.",
        ("", *get_args(Axes)),
    ),
    Parameter("humans", "/humans", "The namespace of the REP-155 topics."),
    Parameter("bodies", [""], "Bodies that are there without a list of tracked ones."),
    Parameter("body_grace_s", 1.0, "Seconds that a body may be missing from the list before it is gone.", most=60.0),
    Parameter("emotion", UNKNOWN, "The emotion of bodies that no expression is told of.", (UNKNOWN, *EMOTIONS)),
    Parameter("emotion_ttl_s", 2.0, "Seconds that an expression holds, by its stamp; 0: until the next.", most=3600.0),
    Parameter("min_confidence", 0.0, "Expressions that are less sure than this are passed over.", most=1.0),
    Parameter("pair_alone", default=True, description="Without any person, let the only face belong to the only body."),
    Parameter("diagnostics_period_s", 1.0, "Seconds from one diagnostics message to the next.", most=60.0),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Settings:
    """The values, checked. Fields are called as the parameters are."""

    service: str
    source: Source
    skeleton: Skeleton
    axes: Axes | None
    humans: str
    bodies: tuple[str, ...]
    body_grace_ns: int
    emotion: str
    emotion_ttl_ns: int | None
    min_confidence: float
    pair_alone: bool
    diagnostics_period_s: float


def settings_of(values: Mapping[str, Any]) -> Settings:
    """The settings of parameters by name.

    Raises:
        InputError: a value that is none of the choices or out of range, or values that don't go together.
    """
    for parameter in PARAMETERS:
        _check(parameter, values[parameter.name])
    source: Source = values["source"]
    skeleton = SKELETONS[values["skeleton"]]
    if source != "joint_rotations" and (skeleton is not ROS4HRI or values["axes"]):
        raise InputError(f"skeleton and axes go with source joint_rotations; expected neither beside {source}")
    ttl_s: float = values["emotion_ttl_s"]
    return Settings(
        service=values["service"],
        source=source,
        skeleton=skeleton,
        axes=cast("Axes | None", values["axes"] or None),
        humans=values["humans"],
        bodies=tuple(body for body in values["bodies"] if body),
        body_grace_ns=nanoseconds(values["body_grace_s"]),
        emotion=values["emotion"],
        emotion_ttl_ns=nanoseconds(ttl_s) if ttl_s > 0 else None,
        min_confidence=values["min_confidence"],
        pair_alone=values["pair_alone"],
        diagnostics_period_s=values["diagnostics_period_s"],
    )


def nanoseconds(seconds: float) -> int:
    """Seconds as ROS counts time."""
    return round(seconds * 1e9)


def _check(parameter: Parameter, value: Any) -> None:
    if parameter.choices and value not in parameter.choices:
        listed = ", ".join(choice or "empty" for choice in parameter.choices)
        raise InputError(f"parameter {parameter.name} is {value!r}; expected one of {listed}")
    if parameter.most is not None and not 0.0 <= value <= parameter.most:
        raise InputError(f"parameter {parameter.name} is {value}; expected 0 to {parameter.most:g}")
