"""BVH files: a joint tree with offsets, then Euler angles in degrees, one row of channels a frame.

Rules. Keywords in any case; spaces, tabs and line ends as they come; numbers of the motion are counted, not lines. Each
joint has its own channels in its own order, R = the product of its rotations in that order (intrinsic); a rotation it
has no channel for is zero. Root positions are read past: the rig has no root. What does not add up is refused with file
and line. The first frame is kept, also where it is a T-pose; whoever knows the data set drops it.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError, RecordingError
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content, read_content
from fervor.rotations import from_euler, identity
from fervor.skeletons.recognise import recognise

MAX_JOINTS = 1000
"""A body with fingers and face has about 200."""

MAX_DEPTH = 200
"""Joints from the root to a tip; a body with fingers has about 12."""

_CHANNEL = re.compile(r"([XYZ])(rotation|position)", re.IGNORECASE)


@dataclass(slots=True)
class _Joint:
    """A joint as it is being read."""

    name: str
    parent: int
    offset: list[float] | None = None
    channels: list[str] | None = None  # "Xp" position, "Xr" rotation
    end: list[float] | None = None  # offset of its end site


@dataclass(slots=True)
class _Words:
    """The words of a text, one after the other, with the line each stands on."""

    source: str
    lines: list[str]
    number: int = 0  # of the current line, from 1
    waiting: list[str] = field(default_factory=list)

    def fail(self, what: str, line: int | None = None) -> NoReturn:
        """Raises with file and line."""
        raise RecordingError(f"{self.source}, line {line or max(self.number, 1)}: {what}")

    def next(self, expected: str) -> str:
        """The next word; `expected` says what it should be, for the message at the end of the file."""
        while not self.waiting:
            if self.number >= len(self.lines):
                self.fail(f"the file ends where {expected} was expected")
            self.waiting = self.lines[self.number].replace("{", " { ").replace("}", " } ").split()[::-1]
            self.number += 1
        return self.waiting.pop()

    def keyword(self, word: str) -> None:
        """Reads past a keyword or brace."""
        got = self.next(repr(word))
        if got.upper() != word.upper():
            self.fail(f"expected {word!r}, found {got[:40]!r}")

    def real(self, expected: str) -> float:
        """A finite number."""
        got = self.next(expected)
        value = _real(got)
        if value is None:
            self.fail(f"expected {expected}, found {got[:40]!r}")
        return value

    def rest_of_line(self) -> str:
        """The words left on this line."""
        rest = " ".join(self.waiting[::-1])
        self.waiting = []
        return rest


def read_bvh(
    source: Path | str | IO[Any], *, name: str | None = None, segments: Mapping[str, str | None] | None = None
) -> Recording:
    """Reads a BVH file.

    Args:
        source: a path, or an open text or binary stream.
        name: of the recording; by default the file's name without suffix.
        segments: joint names of rig segments, where names can't be recognised; None for one to leave unseen.

    Raises:
        RecordingError: the file can't be used; the sentence says where and why.
    """
    return parse_bvh(read_content(source, name), segments=segments)


def parse_bvh(content: Content, *, segments: Mapping[str, str | None] | None = None) -> Recording:
    """`read_bvh` for a content that has been read already."""
    words = _Words(content.label, content.text.splitlines())
    if not content.data.strip():
        words.fail("the file is empty")
    start = words.next("HIERARCHY")
    if start.upper() != "HIERARCHY":
        words.fail(f"not a BVH file: expected HIERARCHY, found {start[:40]!r}")
    joints = _read_tree(words)
    frames, seconds = _read_motion_head(words)
    values = _read_values(words, frames, sum(len(joint.channels or ()) for joint in joints))
    try:
        skeleton = recognise(
            [joint.name for joint in joints],
            [joint.parent for joint in joints],
            np.array([joint.offset or (0.0, 0.0, 0.0) for joint in joints], np.float64),
            ends={index: np.array(joint.end) for index, joint in enumerate(joints) if joint.end is not None},
            segments=segments,
        )
    except InputError as error:
        raise RecordingError(f"{content.label}: {error.message}") from error
    return Recording(
        name=content.name,
        skeleton=skeleton,
        times=np.arange(frames, dtype=np.float64) * seconds,
        rotations=_rotations(joints, values),
        observed=np.ones((frames, len(joints)), np.bool_),
        axes="local",
    )


def _read_tree(words: _Words) -> list[_Joint]:
    """Everything between HIERARCHY and MOTION: joints, parents before children."""
    words.keyword("ROOT")
    joints: list[_Joint] = []
    names: set[str] = set()
    open_joints = [_begin(words, joints, names, -1)]
    while open_joints:
        joint = joints[open_joints[-1]]
        word = words.next("'}'").upper()
        if word == "OFFSET":
            joint.offset = [words.real("a number of OFFSET") for _ in range(3)]
        elif word == "CHANNELS":
            _read_channels(words, joint)
        elif word == "JOINT" and len(open_joints) == MAX_DEPTH:
            words.fail(f"more than {MAX_DEPTH} joints inside each other")
        elif word == "JOINT":
            open_joints.append(_begin(words, joints, names, open_joints[-1]))
        elif word == "END":
            _read_end_site(words, joint)
        elif word == "}":
            open_joints.pop()
        else:
            words.fail(f"expected OFFSET, CHANNELS, JOINT, End Site or '}}', found {word[:40]!r}")
    words.keyword("MOTION")
    return joints


def _begin(words: _Words, joints: list[_Joint], names: set[str], parent: int) -> int:
    """Reads a joint's name and brace; returns its index."""
    name = words.next("a joint name")
    line = words.number
    while (more := words.next("'{'")) != "{":  # some names hold spaces
        if words.number != line:
            words.fail(f"expected '{{' after the joint {name[:40]!r}, found {more[:40]!r}")
        name = f"{name} {more}"
    if name in names:
        words.fail(f"the joint name {name[:40]!r} appears twice", line)
    if len(joints) == MAX_JOINTS:
        words.fail(f"more than {MAX_JOINTS} joints")
    names.add(name)
    joints.append(_Joint(name, parent))
    return len(joints) - 1


def _read_channels(words: _Words, joint: _Joint) -> None:
    """Reads the channels of a joint in their order."""
    if joint.channels is not None:
        words.fail(f"the joint {joint.name!r} has CHANNELS twice")
    count = words.real("a number of CHANNELS")
    if count not in range(7):
        words.fail(f"expected 0 to 6 CHANNELS, found {count:g}")
    joint.channels = []
    for _ in range(int(count)):
        word = words.next("a channel")
        match = _CHANNEL.fullmatch(word)
        if match is None:
            words.fail(f"expected a channel such as Xrotation, found {word[:40]!r}")
        channel = match[1].upper() + match[2][0].lower()
        if channel in joint.channels:
            words.fail(f"the joint {joint.name!r} has the channel {word} twice")
        joint.channels.append(channel)


def _read_end_site(words: _Words, joint: _Joint) -> None:
    """Reads `End Site { OFFSET x y z }`; of several, the first one counts."""
    words.keyword("Site")
    words.keyword("{")
    words.keyword("OFFSET")
    end = [words.real("a number of OFFSET") for _ in range(3)]
    joint.end = joint.end or end
    words.keyword("}")


def _read_motion_head(words: _Words) -> tuple[int, float]:
    """Reads `Frames: n` and `Frame Time: s`."""
    frames = _after_colon(words, "Frames:")
    if not (frames >= 1 and frames == int(frames)):
        words.fail(f"expected a whole number of Frames from 1, found {frames:g}")
    seconds = _after_colon(words, "Frame Time:")
    if not seconds > 0.0:
        words.fail(f"expected a Frame Time over 0 seconds, found {seconds:g}")
    return int(frames), seconds


def _after_colon(words: _Words, label: str) -> float:
    """The number after a label that may be written with or without spaces."""
    first = words.next(repr(label))
    line = f"{first} {words.rest_of_line()}"
    if "".join(line.split()).upper() == label.replace(" ", "").upper():
        line = f"{line} {words.next(f'a number after {label}')}"
    pattern = label.replace(" ", r"\s*").replace(":", r"\s*:?\s*") + r"(\S+)"
    match = re.fullmatch(pattern, line.strip(), re.IGNORECASE)
    value = _real(match[1]) if match else None
    if value is None:
        words.fail(f"expected '{label}' and a number, found {line.strip()[:40]!r}")
    return value


def _read_values(words: _Words, frames: int, channels: int) -> npt.NDArray[np.float64]:
    """All numbers of the motion [frame, channel]."""
    if channels == 0:
        words.fail("no joint has any channels")
    motion = "\n".join(words.lines[words.number :])
    try:
        values = np.array([float(token) for token in motion.split()], np.float64)
        readable = "_" not in motion and bool(np.isfinite(values).all())
    except ValueError:
        readable = False
    if not readable:
        line, token = next(_bad_tokens(words))
        words.fail(f"expected a finite number, found {token[:40]!r}", line)
    if len(values) < frames * channels:
        found = len(values) // channels
        words.fail(f"the motion has {found} of {frames} frames ({channels} numbers each)", len(words.lines))
    if len(values) > frames * channels:
        words.fail(f"the motion has more than its {frames} frames ({channels} numbers each)", len(words.lines))
    return values.reshape(frames, channels)


def _bad_tokens(words: _Words) -> Iterator[tuple[int, str]]:
    """Line and text of what is no finite number among the values."""
    for number, line in enumerate(words.lines[words.number :], start=words.number + 1):
        yield from ((number, token) for token in line.split() if _real(token) is None)


def _real(token: str) -> float | None:
    """A finite number, or None: Python's "1_000" and "inf" are none."""
    try:
        value = float(token)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in token else None


def _rotations(joints: list[_Joint], values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Local rotations [frame, joint, 4]; joints with the same order of channels are worked out together."""
    orders: dict[str, tuple[list[int], list[list[int]]]] = {}
    column = 0
    for index, joint in enumerate(joints):
        turns = [
            (channel[0], column + place) for place, channel in enumerate(joint.channels or ()) if channel[1] == "r"
        ]
        column += len(joint.channels or ())
        members, columns = orders.setdefault("".join(axis for axis, _ in turns), ([], []))
        members.append(index)
        columns.append([place for _, place in turns])
    rotations = identity((len(values), len(joints)))
    for order, (members, columns) in orders.items():
        if order:
            rotations[:, members] = from_euler(order, values[:, np.array(columns)])
    return rotations
