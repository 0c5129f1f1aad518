"""People in Xsens suits, and their MVNX files in MVN's layout."""

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fervor.skeletons.catalog import skeleton
from fervor.skeletons.rig import CHILD_SEGMENT, PARENT_SEGMENT, SEGMENTS

Array = npt.NDArray[np.float64]
XSENS = skeleton("xsens_mvn")
TO_WORLD = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""Left, up, forward to MVN's forward, left, up."""
ARMS = {"l_uparm": 90, "l_forearm": 90, "l_hand": 90, "r_uparm": -90, "r_forearm": -90, "r_hand": -90}


class Person:
    """Someone in a suit: a heading, and axes for each segment that only MVN knows."""

    def __init__(self, *, heading: float = 0.0, plain_axes: bool = True, seed: int = 0) -> None:
        self.heading = Rotation.from_rotvec([0, 0, heading], degrees=True)
        stray = Rotation.random(len(SEGMENTS), random_state=seed)
        self.axes = []
        for index, segment in enumerate(SEGMENTS):
            turned = Rotation.from_rotvec([0, 0, ARMS.get(segment, 0)], degrees=True)
            plain = turned.inv() * TO_WORLD.inv()  # the identity, but for the heading, in a T-pose
            self.axes.append(plain if plain_axes or segment == "pelvis" else turned.inv() * stray[index])

    def sent(self, whole: list[Rotation], labels: list[str]) -> Array:
        """[segment, 4] w first, for absolute segment orientations in body axes."""
        rows = []
        for label in labels:
            drive = XSENS.joints.index(label) if label in XSENS.joints else None
            if drive in XSENS.drives and drive is not None:
                index = XSENS.drives.index(drive)
                q = (self.heading * TO_WORLD * whole[index] * self.axes[index]).as_quat()
            else:
                q = np.array([0.5, 0.5, 0.5, 0.5])
            rows.append(np.roll(q, 1))
        return np.stack(rows)


def posed(local: Array) -> list[Rotation]:
    whole = [Rotation.identity()] * len(SEGMENTS)
    for joint in range(13):
        whole[CHILD_SEGMENT[joint]] = whole[PARENT_SEGMENT[joint]] * Rotation.from_quat(local[joint])
    return whole


def standing(pose: str) -> list[Rotation]:
    return [Rotation.from_rotvec([0, 0, ARMS.get(s, 0) if pose == "tpose" else 0], degrees=True) for s in SEGMENTS]


def numbers(rows: Array) -> str:
    return " ".join(f"{value:.17g}" for value in rows.ravel())


def mvnx(
    local: Array,
    person: Person,
    *,
    labels: list[str] | None = None,
    poses: tuple[str, ...] = ("identity", "tpose", "tpose-isb"),
    rate: str = 'frameRate="240"',
    stamp: str = 'time="{time}" index="{index}"',
    namespace: bool = True,
    name_segments: bool = True,
) -> str:
    """The file of somebody who moves as `local` [frame, 13, 4] says."""
    labels = labels or list(XSENS.joints)
    odd = np.tile([0.7, 0.7, 0.1, 0.1], (len(labels), 1))
    held = {
        pose: odd if pose in ("identity", "tpose-isb") else person.sent(standing(pose), labels) for pose in poses
    }  # fmt: skip
    named = "".join(f'<segment id="{i + 1}" label="{label}"><points/></segment>' for i, label in enumerate(labels))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<mvnx{" xmlns=" + chr(34) + "http://www.xsens.com/mvn/mvnx" + chr(34) if namespace else ""} version="4">',
        '<mvn version="2019.0"/><comment>dance &amp; joy</comment>',
        f'<subject label="Suit 1" {rate} segmentCount="{len(labels)}">',
        f"<segments>{named}</segments>" if name_segments else "",
        '<frames segmentCount="23" sensorCount="17" jointCount="22">',
    ]
    for pose, rows in held.items():
        lines.append(
            f'<frame time="0" index="" tc="" ms="0" type="{pose}"><orientation>{numbers(rows)}</orientation></frame>'
        )
    for index, row in enumerate(local):
        at = stamp.format(time=round(index * 1000 / 240), index=index + 5)
        rows = person.sent(posed(row), labels)
        lines.append(
            f'<frame {at} tc="" ms="15" type="normal"><orientation>{numbers(rows)}</orientation>'
            f"<position>{numbers(rows)}</position><jointAngle>1 2 3</jointAngle></frame>"
        )
    return "\n".join([*lines, "</frames></subject></mvnx>"])
