"""MVNX files of Xsens MVN: absolute orientations of 23 segments, w first, in axes forward, left, up.

Rules. Frames of type `normal` are the motion. The frame of type `tpose` (or `npose`) tells how the segments' axes lie
in that pose and where the person faced, and gives the alignment (formula 4); without one, the catalogue's alignment
holds. Joint angles are not read: they are in another convention. Frame numbers and the frame rate give the times,
because the times in the file are whole milliseconds. A DOCTYPE is refused, and with it every entity.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any
from xml.etree.ElementTree import ParseError, XMLParser

import numpy as np
import numpy.typing as npt

from fervor.errors import RecordingError
from fervor.recordings.recording import Recording
from fervor.recordings.source import Content, read_content
from fervor.rotations import conjugate, from_axis_angle, multiply, normalise, rotate, to_xyzw
from fervor.skeletons.binds import T_POSE, Quaternion
from fervor.skeletons.naming import REQUIRED
from fervor.skeletons.rig import SEGMENTS
from fervor.skeletons.skeleton import Skeleton
from fervor.skeletons.xsens import FORWARD_LEFT_UP, XSENS_MVN

CHUNK = 1 << 16
"""Bytes fed to the parser at a time, so that a refused file stops early."""

_HELD_POSES: Mapping[str, Mapping[str, Quaternion]] = {"tpose": T_POSE, "npose": {}}


@dataclass(frozen=True, slots=True)
class _Frame:
    """One normal frame."""

    index: str
    time: str  # ms
    orientation: str


@dataclass(slots=True)
class _Contents:
    """What the parser collects; its methods are those an XMLParser calls on its target."""

    label: str
    rate: str = ""
    segments: list[str] = field(default_factory=list)
    frames: list[_Frame] = field(default_factory=list)
    held: dict[str, str] = field(default_factory=dict)  # pose → orientations
    _root: str = ""
    _frame: Mapping[str, str] = field(default_factory=dict)
    _text: list[str] | None = None
    _orientation: str = ""

    def start(self, tag: str, attributes: Mapping[str, str]) -> None:
        """An element begins."""
        tag = tag.rpartition("}")[2]
        if not self._root:
            self._root = tag
            if tag != "mvnx":
                raise RecordingError(f"{self.label}: not an MVNX file: expected <mvnx>, found <{tag[:40]}>")
        elif tag == "subject":
            self.rate = self.rate or attributes.get("frameRate", "")
        elif tag == "segment":
            self.segments.append(attributes.get("label", ""))
        elif tag == "frame":
            self._frame, self._orientation = attributes, ""
        elif tag == "orientation":
            self._text = []

    def data(self, text: str) -> None:
        """Text inside an element."""
        if self._text is not None:
            self._text.append(text)

    def end(self, tag: str) -> None:
        """An element ends."""
        tag = tag.rpartition("}")[2]
        if tag == "orientation" and self._text is not None:
            self._orientation, self._text = "".join(self._text), None
        elif tag == "frame":
            kind = self._frame.get("type", "normal").replace("-", "")
            if kind == "normal":
                self.frames.append(_Frame(self._frame.get("index", ""), self._frame.get("time", ""), self._orientation))
            elif kind in _HELD_POSES:
                self.held.setdefault(kind, self._orientation)

    def doctype(self, *_: str | None) -> None:
        """A DOCTYPE begins."""
        raise RecordingError(f"{self.label}: the file has a DOCTYPE; expected none in MVNX")

    def close(self) -> None:
        """The document ends."""


def read_mvnx(source: Path | str | IO[Any], *, name: str | None = None) -> Recording:
    """Reads an MVNX file: global rotations of the skeleton `xsens_mvn`, aligned by the file's own reference pose.

    Args:
        source: a path, or an open text or binary stream.
        name: of the recording; by default the file's name without suffix.

    Raises:
        RecordingError: the file can't be used; the sentence says where and why.
    """
    return parse_mvnx(read_content(source, name))


def parse_mvnx(content: Content) -> Recording:
    """`read_mvnx` for a content that has been read already."""
    contents = _parse(content)
    if not contents.frames:
        raise RecordingError(f"{content.label}: no frame of type normal; expected some motion")
    sent = contents.segments or list(XSENS_MVN.joints)
    places = _places(content.label, sent)
    rows = [
        _orientations(content.label, f"frame {number}", frame.orientation, len(sent))
        for number, frame in enumerate(contents.frames)
    ]
    rotations = np.zeros((len(rows), len(XSENS_MVN.joints), 4))
    rotations[:, list(places)] = np.stack(rows)[:, list(places.values())]
    observed = np.zeros(rotations.shape[:-1], np.bool_)
    observed[:, list(places)] = True
    return Recording(
        name=content.name,
        skeleton=_aligned(content.label, contents.held, places, len(sent)),
        times=_times(content.label, contents),
        rotations=rotations,
        observed=observed,
        axes="global",
    )


def _parse(content: Content) -> _Contents:
    """Runs the parser over the file."""
    contents = _Contents(content.label)
    if b"<!DOCTYPE" in content.data:
        contents.doctype()
    parser = XMLParser(target=contents)  # noqa: S314 - a DOCTYPE, and so every entity, is refused
    try:
        for start in range(0, len(content.data), CHUNK):
            parser.feed(content.data[start : start + CHUNK])
        parser.close()
    except ParseError as error:
        what = error.msg.partition(":")[0]
        raise RecordingError(f"{content.label}, line {error.position[0]}: not well-formed XML ({what})") from error
    except (ValueError, LookupError) as error:
        raise RecordingError(f"{content.label}: not well-formed XML ({error})") from error
    return contents


def _places(label: str, sent: list[str]) -> dict[int, int]:
    """Where the skeleton's joints stand in the file: joint index → position."""
    places = {XSENS_MVN.joints.index(name): at for at, name in enumerate(sent) if name in XSENS_MVN.joints}
    needed = {segment: XSENS_MVN.drives[SEGMENTS.index(segment)] for segment in REQUIRED}
    missing = [XSENS_MVN.joints[joint] for joint in needed.values() if joint is not None and joint not in places]
    if missing:
        raise RecordingError(f"{label}: no segment {', '.join(missing)} among {', '.join(sent[:40]) or 'none'}")
    return places


def _orientations(label: str, where: str, text: str, count: int) -> npt.NDArray[np.float64]:
    """The orientations of one frame [segment, 4] xyzw."""
    try:
        numbers = np.array(text.split(), np.float64)
    except ValueError:
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all():
        raise RecordingError(f"{label}: {where} holds something else than finite numbers in <orientation>")
    if len(numbers) != 4 * count:
        raise RecordingError(f"{label}: {where} has {len(numbers)} numbers in <orientation>; expected {4 * count}")
    return to_xyzw(numbers.reshape(count, 4), "wxyz")


def _aligned(label: str, held: Mapping[str, str], places: Mapping[int, int], count: int) -> Skeleton:
    """The skeleton, aligned by the first reference pose of the file: A_j = T_j^-1 · C · heading^-1 · Q_j."""
    kind = next((kind for kind in _HELD_POSES if held.get(kind)), None)
    pelvis = XSENS_MVN.joints.index("Pelvis")
    if kind is None or pelvis not in places:
        return XSENS_MVN
    reference = normalise(_orientations(label, f"the frame of type {kind}", held[kind], count))
    forward = rotate(reference[places[pelvis]], np.array([1.0, 0.0, 0.0]))
    heading = from_axis_angle(np.array([0.0, 0.0, 1.0]), np.arctan2(forward[1], forward[0]))
    to_body = multiply(FORWARD_LEFT_UP, conjugate(heading))
    bind = XSENS_MVN.bind.copy()
    for index, (segment, drive) in enumerate(zip(SEGMENTS, XSENS_MVN.drives, strict=True)):
        if drive is not None and drive in places:
            whole = multiply(to_body, reference[places[drive]])
            turned = _HELD_POSES[kind].get(segment)
            bind[index] = whole if turned is None else multiply(conjugate(turned), whole)
    return replace(XSENS_MVN, bind=bind)


def _times(label: str, contents: _Contents) -> npt.NDArray[np.float64]:
    """Times [frame] in seconds from the first frame."""
    rate = _number(contents.rate)
    indices = np.array([_number(frame.index) for frame in contents.frames], np.float64)
    stamps = np.array([_number(frame.time) for frame in contents.frames], np.float64) / 1000.0
    if np.isnan(indices).all() and np.isnan(stamps).all():
        indices = np.arange(len(indices), dtype=np.float64)
    candidates: list[npt.NDArray[np.float64]] = [stamps] if not rate > 0.0 else [indices / rate, stamps]
    for times in candidates:
        if np.isfinite(times).all() and bool(np.all(np.diff(times) > 0)):
            shifted: npt.NDArray[np.float64] = times - times[0]
            return shifted
    raise RecordingError(f"{label}: frames have no rising index with a frameRate, nor rising times")


def _number(text: str) -> float:
    """A finite number, or NaN."""
    try:
        value = float(text)
    except ValueError:
        return float("nan")
    return value if np.isfinite(value) else float("nan")
