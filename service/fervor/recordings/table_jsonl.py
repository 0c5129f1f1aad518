"""Recordings as JSON lines, in the words of the wire protocol: a header, then one frame a line.

    {"skeleton": "kinect_v2", "axes": "global", "quaternion": "xyzw", "joints": ["SpineBase", …]}
    {"t": 0.0, "q": [[0, 0, 0, 1], null, …]}

All of the header may be missing, and `rate_hz` in it stands for times. Frames have `q`, quaternions, or `p`, positions;
null is a joint that was not tracked, and `mask` may say the same. Other fields are ignored, and so are lines whose
`type` is none of `session.start`, `frame` and `frames`: the client side of a recorded conversation about one body is a
recording.
"""

import json
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.source import Content
from fervor.recordings.tabular import Table, to_recording
from fervor.skeletons.skeleton import Skeleton

_NUMBERS = {"q": 4, "p": 3}


def parse_jsonl(content: Content, skeleton: str | Skeleton | None = None) -> Recording:
    """The recording in a file of JSON lines.

    Raises:
        RecordingError: the file can't be used; the sentence says where and why.
    """
    header: dict[str, Any] = {}
    frames: list[tuple[int, dict[str, Any]]] = []
    for number, line in enumerate(content.text.splitlines(), start=1):
        if not line.strip():
            continue
        message = _object(content.label, number, line)
        if message.get("type") == "frames" and isinstance(message.get("frames"), list):
            frames += [(number, frame) for frame in message["frames"] if isinstance(frame, dict)]
        elif message.get("type", "frame") == "frame" and ("q" in message or "p" in message):
            frames.append((number, message))
        elif not frames and message.get("type", "session.start") == "session.start":
            header = message
    if not frames:
        raise RecordingError(f"{content.label}: no line has q or p; expected frames")
    if len({json.dumps(message.get("body")) for _, message in frames}) > 1:
        raise RecordingError(f"{content.label}: frames of several bodies; expected those of one")
    values, observed = _values(content.label, frames)
    timed = "rate_hz" not in header or any("t" in message for _, message in frames)
    table = Table(
        label=content.label,
        name=content.name,
        values=values,
        times=_times(content.label, frames) if timed else None,
        rate_hz=_rate(content.label, header.get("rate_hz")),
        observed=observed,
        joints=_joints(content.label, header.get("joints")),
        skeleton=_text(content.label, header, "skeleton"),
        axes=_text(content.label, header, "axes"),
        quaternion=_text(content.label, header, "quaternion"),
    )
    return to_recording(table, skeleton)


def _object(label: str, number: int, line: str) -> dict[str, Any]:
    """One line as a JSON object."""
    try:
        message = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{label}, line {number}: not JSON ({error})") from None
    if not isinstance(message, dict):
        raise RecordingError(f"{label}, line {number}: expected a JSON object, found {line.strip()[:40]}")
    return message


def _values(
    label: str, frames: list[tuple[int, dict[str, Any]]]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Numbers [frame, joint, 4 or 3] and mask [frame, joint]."""
    key = "q" if "q" in frames[0][1] else "p"
    width = _NUMBERS[key]
    rows: list[list[list[float]]] = []
    masks: list[list[bool]] = []
    for number, message in frames:
        joints = message.get(key)
        if not isinstance(joints, list) or not joints or (rows and len(joints) != len(rows[0])):
            expected = f"{len(rows[0])} joints as before" if rows else "a list of joints"
            raise RecordingError(f"{label}, line {number}: {key!r} does not fit; expected {expected}")
        mask = message.get("mask")
        if mask is not None and not (isinstance(mask, list) and len(mask) == len(joints)):
            raise RecordingError(f"{label}, line {number}: 'mask' does not fit; expected {len(joints)} entries")
        rows.append([_joint(label, number, joint, width) for joint in joints])
        masks.append([True] * len(joints) if mask is None else [bool(entry) for entry in mask])
    return np.array(rows, np.float64), np.array(masks, np.bool_)


def _joint(label: str, number: int, joint: Any, width: int) -> list[float]:
    """The numbers of one joint; NaN for null."""
    if joint is None:
        return [np.nan] * width
    if isinstance(joint, list) and len(joint) == width and all(type(part) in (int, float) for part in joint):
        try:
            return [float(part) for part in joint]
        except OverflowError:
            pass
    raise RecordingError(
        f"{label}, line {number}: expected {width} numbers or null for a joint, found {str(joint)[:40]}"
    )


def _times(label: str, frames: list[tuple[int, dict[str, Any]]]) -> npt.NDArray[np.float64]:
    for number, message in frames:
        if type(message.get("t")) not in (int, float):
            raise RecordingError(f"{label}, line {number}: expected seconds in 't', found {str(message.get('t'))[:40]}")
    return np.array([message["t"] for _, message in frames], np.float64)


def _rate(label: str, rate: Any) -> float | None:
    if rate is None or type(rate) in (int, float):
        return rate  # type: ignore[no-any-return]  # checked in this line
    raise RecordingError(f"{label}: expected a number for 'rate_hz', found {str(rate)[:40]}")


def _joints(label: str, joints: Any) -> tuple[str, ...] | None:
    if joints is None or (isinstance(joints, list) and all(isinstance(joint, str) for joint in joints)):
        return None if joints is None else tuple(joints)
    raise RecordingError(f"{label}: expected a list of names in 'joints', found {str(joints)[:40]}")


def _text(label: str, header: dict[str, Any], key: str) -> str | None:
    value = header.get(key)
    if value is None or isinstance(value, str):
        return value
    raise RecordingError(f"{label}: expected a name in {key!r}, found {str(value)[:40]}")


def jsonl_of(recording: Recording) -> str:
    """A recording's canonical rotations as JSON lines; unobserved joints are null."""
    times, local, observed = rig_poses(recording)
    lines = [json.dumps({"skeleton": "c13", "axes": "local", "quaternion": "xyzw"})]
    for time, pose, seen in zip(times.tolist(), local.tolist(), observed.tolist(), strict=True):
        q = [joint if here else None for joint, here in zip(pose, seen, strict=True)]
        lines.append(json.dumps({"t": time, "q": q}))
    return "\n".join(lines) + "\n"
