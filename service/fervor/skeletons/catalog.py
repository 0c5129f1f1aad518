"""The catalogue: every skeleton that can be named in a session or on the command line."""

from collections.abc import Mapping

from fervor.errors import InputError
from fervor.skeletons.azure_kinect import AZURE_KINECT
from fervor.skeletons.canonical import C13
from fervor.skeletons.cmu import CMU
from fervor.skeletons.ebmdb import EBMDB
from fervor.skeletons.kinect import KINECT_V1, KINECT_V2
from fervor.skeletons.landmarks import LANDMARKS, Landmarks
from fervor.skeletons.openni import NITE, NUITRACK
from fervor.skeletons.ros4hri import ROS4HRI
from fervor.skeletons.skeleton import Skeleton
from fervor.skeletons.smpl import SMPL
from fervor.skeletons.xsens import XSENS_MVN

_ALL = (C13, KINECT_V2, KINECT_V1, AZURE_KINECT, NITE, NUITRACK, ROS4HRI, XSENS_MVN, SMPL, EBMDB, CMU)

SKELETONS: Mapping[str, Skeleton] = {known.name: known for known in _ALL}
"""Skeletons by name."""


def skeleton(name: str) -> Skeleton:
    """The skeleton called `name`, in any case and with - for _.

    Raises:
        InputError: no such skeleton.
    """
    known = SKELETONS.get(name.strip().lower().replace("-", "_"))
    if known is None:
        raise InputError(f"skeleton {name!r} is not known; expected one of {', '.join(SKELETONS)}")
    return known


def source(name: str) -> Skeleton | Landmarks:
    """The skeleton or landmark sensor called `name`, in any case and with - for _.

    Raises:
        InputError: no such source.
    """
    key = name.strip().lower().replace("-", "_")
    known = SKELETONS.get(key) or LANDMARKS.get(key)
    if known is None:
        raise InputError(f"skeleton {name!r} is not known; expected one of {', '.join([*SKELETONS, *LANDMARKS])}")
    return known
