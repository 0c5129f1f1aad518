"""The core of the node, without ROS: what is perceived of people becomes frames for the service, and back.

Rules. Everything comes in one thread, with its stamp. A frame's time is its pose's stamp, so that simulated time and
bags give what they gave live. Every frame bears the label in force at its stamp: one that is dropped on its way takes
no label with it. Numbers rise over all bodies, so that an id that comes back is never taken for its old self.
"""

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import Estimate
from fervor_ros.expressions import emotion_of
from fervor_ros.human_description import link_rotations
from fervor_ros.parameters import Settings
from fervor_ros.people import Label, People
from fervor_ros.pose import Pose, Stamp, in_order
from fervor_ros.roster import Roster
from fervor_ros.topics import (
    BODY_OF_PERSON,
    FACE_EXPRESSION,
    FACE_OF_PERSON,
    INTENSITY,
    JOINT_ROTATIONS,
    JOINT_STATES,
    PERSON_EXPRESSION,
    Topic,
)
from fervor_ros.transforms import Transform, Transforms

MOST_UNANSWERED = 8192
"""Stamps kept for estimates that have not come; more frames are never under way."""

MOST_FIXED = 4096
"""Static frames kept: those of the robot, and a few of every body that ever came."""

NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What goes to the service for one pose."""

    body: str
    seq: int
    t: float  # seconds
    rotations: npt.NDArray[np.float64]  # [joint, 4] xyzw
    emotion: str


@dataclass(frozen=True, slots=True)
class Answer:
    """What comes back, with what ROS wants to know beside."""

    estimate: Estimate
    stamp: Stamp
    person: str


class Perception:
    """All people before the robot."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._roster = Roster(settings.bodies, settings.body_grace_ns)
        self._people = People(settings.emotion, settings.emotion_ttl_ns, settings.pair_alone)
        self._transforms: dict[str, Transforms] = {}
        self._fixed: OrderedDict[str, Transform] = OrderedDict()
        self._moving: set[str] = set()
        self._watched: frozenset[str] = frozenset()
        self._seq = 0
        self._stamps: OrderedDict[int, Stamp] = OrderedDict()

    # --- who there is -------------------------------------------------------------------------------------------------

    @property
    def bodies(self) -> frozenset[str]:
        """Ids of the bodies there are."""
        return self._roster.bodies

    @property
    def interests(self) -> frozenset[tuple[Topic, str]]:
        """The topics of single humans that matter now."""
        poses = {"joint_states": {JOINT_STATES}, "joint_rotations": {JOINT_ROTATIONS}, "tf": set[Topic]()}
        kinds = (
            (poses[self._settings.source] | {INTENSITY}, self.bodies),
            ({BODY_OF_PERSON, FACE_OF_PERSON, PERSON_EXPRESSION}, self._people.known_persons),
            ({FACE_EXPRESSION}, self._people.known_faces),
        )
        return frozenset((topic, human) for topics, humans in kinds for topic in topics for human in humans)

    def bodies_listed(self, ids: Iterable[str], now: Stamp) -> None:
        """A list of the bodies that are tracked."""
        self._roster.listed(ids, now)

    def persons_listed(self, ids: Iterable[str]) -> None:
        """A list of the persons that are tracked."""
        self._people.persons(ids)

    def faces_listed(self, ids: Iterable[str]) -> None:
        """A list of the faces that are tracked."""
        self._people.faces(ids)

    def matched(self, topic: Topic, person: str, part: str) -> None:
        """A person's body or face; empty: none."""
        match = self._people.match_body if topic == BODY_OF_PERSON else self._people.match_face
        match(person, part)

    def sweep(self, now: Stamp) -> tuple[list[Frame], frozenset[str]]:
        """The last frames of bodies that are gone, and those bodies."""
        gone = self._roster.sweep(now)
        frames = []
        for body in gone:
            transforms = self._transforms.pop(body, None)
            frames += [self._frame(pose) for pose in transforms.flush()] if transforms is not None else []
        return frames, gone

    def silent(self) -> frozenset[str]:
        """Bodies that were there at the last call and sent no pose since."""
        silent = (self._watched & self.bodies) - self._moving
        self._watched, self._moving = self.bodies, set()
        return silent

    # --- what they do -------------------------------------------------------------------------------------------------

    def expression(self, topic: Topic, human: str, expression: str, confidence: float, stamp: Stamp) -> None:
        """A face or a person shows an expression; confidence 0 is none told."""
        if 0.0 < confidence < self._settings.min_confidence:
            return
        label = Label(emotion_of(expression), stamp)
        show = self._people.face_shows if topic == FACE_EXPRESSION else self._people.person_shows
        show(human, label)

    def joint_states(self, body: str, names: Sequence[str], positions: Sequence[float], stamp: Stamp) -> Frame:
        """Joint angles of a body, radians."""
        return self._frame(Pose(body, stamp, link_rotations(names, positions, body=body)))

    def joint_rotations(
        self, body: str, names: Sequence[str], rotations: Iterable[Sequence[float]], stamp: Stamp
    ) -> Frame:
        """Joint rotations of a body, xyzw."""
        joints = self._settings.skeleton.joints
        return self._frame(Pose(body, stamp, in_order(joints, names, rotations, body=body)))

    def transform(self, transform: Transform, *, static: bool = False) -> list[Frame]:
        """A transform of TF, of whatever frame; gives the frames that are whole with it."""
        if static:  # told once, and maybe before its body is listed
            self._fixed[transform.frame] = transform
            self._fixed.move_to_end(transform.frame)
            if len(self._fixed) > MOST_FIXED:
                self._fixed.popitem(last=False)
            return []
        body = self._owner(transform.frame)
        if body is None:
            return []
        transforms = self._transforms.get(body)
        if transforms is None:
            transforms = self._transforms[body] = Transforms(body, self._settings.skeleton, self._fixed)
        return [self._frame(pose) for pose in transforms.move(transform)]

    # --- what comes back ----------------------------------------------------------------------------------------------

    def answered(self, estimate: Estimate) -> Answer:
        """An estimate, with the stamp of its pose."""
        stamp = self._stamps.pop(estimate.seq, round(estimate.t * NS))
        return Answer(estimate, stamp, self._people.person_of(estimate.body))

    def _frame(self, pose: Pose) -> Frame:
        self._moving.add(pose.body)
        self._seq += 1
        self._stamps[self._seq] = pose.stamp
        if len(self._stamps) > MOST_UNANSWERED:
            self._stamps.popitem(last=False)
        emotion = self._people.emotion_of(pose.body, len(self.bodies), pose.stamp)
        # Divided as integers, the seconds are the nearest there are.
        return Frame(pose.body, self._seq, pose.stamp / NS, pose.rotations, emotion)

    def _owner(self, frame: str) -> str | None:
        """The body whose frame it is; ids may end as others do, then the longest counts."""
        return max((body for body in self.bodies if frame.endswith(f"_{body}")), key=len, default=None)
