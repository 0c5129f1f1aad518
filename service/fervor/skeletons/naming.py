"""Which joint of an unknown tree drives which rig segment, told from its names and its shape.

Limbs are found by name: the words of a name ("mixamorig:LeftForeArm", "Bip01 L Forearm", "forearm.l") are split, the
side is taken off, and what is left, or its last words, must be a known name. The trunk is found by shape, because
names of spine joints mean something else in every source: the thorax is where both arms meet, the pelvis the joint
called so or else where legs and thorax meet, and of the joints between them the middle one (the lower of two middle
ones) drives the abdomen.
"""

import re
from collections.abc import Iterable, Mapping, Sequence

from fervor.errors import InputError
from fervor.skeletons.rig import SEGMENTS

REQUIRED: tuple[str, ...] = ("thorax", "l_uparm", "l_forearm", "r_uparm", "r_forearm")
"""Segments without which a tree can't be used at all."""

_UPARM = ("upperarm", "uparm", "arm", "humerus", "shldrbend", "shldr", "shoulder")
_FOREARM = ("forearm", "lowerarm", "lowarm", "loarm", "forearmbend", "elbow", "radius")
_HAND = ("hand", "wrist")
_THIGH = ("upperleg", "upleg", "thigh", "thighbend", "femur", "hip")
_SHANK = ("lowerleg", "lowleg", "shin", "calf", "shank", "tibia", "knee", "leg")
_HEAD = ("head", "skull", "neck1", "neck")
_PELVIS = ("hips", "pelvis", "hip")

_LIMBS: Mapping[str, tuple[str, ...]] = {
    "uparm": _UPARM,
    "forearm": _FOREARM,
    "hand": _HAND,
    "thigh": _THIGH,
    "shank": _SHANK,
}
"""Names of each limb segment, the surest first: a "shoulder" is the upper arm only where nothing is called "arm"."""

_ABOVE = {"forearm": "uparm", "hand": "forearm", "shank": "thigh"}
_SIDES = {"l": "l", "left": "l", "r": "r", "right": "r"}
_WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_LIMB_NAMES = frozenset(name for names in _LIMBS.values() for name in names)
_NAMES = _LIMB_NAMES | {*_HEAD, *_PELVIS}

_Name = tuple[str, str, int]
"""Side ("l", "r" or ""), known name ("" for none), and how many words stand before it."""


def find_segments(
    joints: Sequence[str], parents: Sequence[int], segments: Mapping[str, str | None] | None = None
) -> dict[str, int]:
    """The joint that drives each rig segment, as far as one can be found.

    Args:
        joints: names.
        parents: index of each joint's parent; -1 for a root.
        segments: joint names of segments that the caller knows better; None for a segment to leave unseen.

    Raises:
        InputError: a segment or joint that doesn't exist, or one of `REQUIRED` that can't be found.
    """
    given = _given(joints, segments or {})
    found = {segment: joint for segment, joint in given.items() if joint is not None}
    names = [_understood(joint) for joint in joints]
    for side in ("l", "r"):
        for limb in _LIMBS:
            segment = f"{side}_{limb}"
            if segment not in given:
                above = found.get(f"{side}_{_ABOVE[limb]}") if limb in _ABOVE else None
                _add(found, segment, _best(names, parents, side, _LIMBS[limb], above))
    if "head" not in given:
        _add(found, "head", _best(names, parents, "", _HEAD, None))
    _find_trunk(found, given, names, parents)

    missing = [segment for segment in REQUIRED if segment not in found]
    if missing:
        raise InputError(
            f"no joint was found for {', '.join(missing)} among {_listed(joints)}; "
            f"name them with a map of segments, for example {{{missing[0]!r}: 'NameOfTheJoint'}}"
        )
    return found


def _given(joints: Sequence[str], segments: Mapping[str, str | None]) -> dict[str, int | None]:
    """The caller's map with indices for names."""
    given: dict[str, int | None] = {}
    for segment, joint in segments.items():
        if segment not in SEGMENTS:
            raise InputError(f"segment {segment!r} is not known; expected one of {', '.join(SEGMENTS)}")
        if joint is not None and joint not in joints:
            raise InputError(f"segment {segment!r} names the joint {joint!r}; expected one of {_listed(joints)}")
        given[segment] = None if joint is None else joints.index(joint)
    return given


def _listed(joints: Sequence[str]) -> str:
    """Joint names for a message, not too many."""
    return ", ".join(joints[:40]) + (f" and {len(joints) - 40} more" if len(joints) > 40 else "")


def _understood(joint: str) -> _Name:
    """What a joint name says; the longest known name counts, so that a forearm is no arm."""
    words = [word.lower() for word in _WORD.findall(joint.rsplit(":", 1)[-1])]
    side = next((_SIDES[word] for word in words if word in _SIDES), "")
    words = [word for word in words if word not in _SIDES]
    plain = ["".join(words[start:]) for start in range(len(words))]
    for dropped, name in enumerate(plain):
        if name in _NAMES:
            return side, name, dropped
    for prefix in ("left", "right", "l", "r"):  # "leftarm" and "lhip" are one word
        if not side and plain and plain[0].startswith(prefix) and plain[0][len(prefix) :] in _LIMB_NAMES:
            return _SIDES[prefix], plain[0][len(prefix) :], 0
    return side, "", 0


def _best(
    names: Sequence[_Name], parents: Sequence[int], side: str, wanted: tuple[str, ...], above: int | None
) -> int | None:
    """The joint that fits best: below `above`, with the surest name, the fewest words before it, nearest the root."""
    ranked: list[tuple[int, int, int, int]] = []
    for index, (its_side, name, dropped) in enumerate(names):
        if its_side != side or name not in wanted:
            continue
        way = ancestors(parents, index)
        if above is None or above in way:
            # A hand may be called "wrist" or "hand", or both: then the one nearer to the forearm turns it.
            ranked.append((0 if wanted is _HAND else wanted.index(name), dropped, len(way), index))
    return min(ranked)[-1] if ranked else None


def _find_trunk(
    found: dict[str, int], given: Mapping[str, int | None], names: Sequence[_Name], parents: Sequence[int]
) -> None:
    """Adds thorax, pelvis and abdomen to what was found."""
    arms = [found[arm] for arm in ("l_uparm", "r_uparm") if arm in found]
    if "thorax" not in given and len(arms) == 2:
        _add(found, "thorax", meeting_point(parents, arms))
    if "thorax" not in found:
        return
    if "pelvis" not in given:
        legs = [found[leg] for leg in ("l_thigh", "r_thigh") if leg in found]
        named = _best(names, parents, "", _PELVIS, None)
        root = [*ancestors(parents, found["thorax"]), found["thorax"]][0]
        met = meeting_point(parents, [*legs, found["thorax"]]) if legs else root
        _add(found, "pelvis", met if named is None else named)
    if "abdomen" not in given and "pelvis" in found:
        way = [*ancestors(parents, found["thorax"]), found["thorax"]]
        between = [joint for joint in way if joint not in [*ancestors(parents, found["pelvis"]), found["pelvis"]]]
        found["abdomen"] = between[(len(between) - 1) // 2] if between else found["thorax"]


def _add(found: dict[str, int], segment: str, joint: int | None) -> None:
    if joint is not None:
        found[segment] = joint


def ancestors(parents: Sequence[int], joint: int) -> list[int]:
    """Joints from the root down to the parent of `joint`; for a root, the root itself is not among them."""
    above: list[int] = []
    while parents[joint] >= 0:
        joint = parents[joint]
        above.append(joint)
    return above[::-1]


def meeting_point(parents: Sequence[int], joints: Iterable[int]) -> int | None:
    """The lowest joint that lies above all of `joints`; one of them may lie above the others."""
    shared: list[int] | None = None
    for joint in joints:
        way = [*ancestors(parents, joint), joint]
        shared = way if shared is None else [a for a, b in zip(shared, way, strict=False) if a == b]
    return shared[-1] if shared else None
