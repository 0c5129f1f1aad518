"""What EBMDB's file names say: actor, emotion, and how long the recording is.

Two patterns are in use:

    AnBh_0208_ftf_wd_t3-002_91_560809_563542_2733_Anger     … start, end, duration in ms, emotion
    DiMi_0709_ft_ch_t1_anger_07830-08215                    … emotion, first and last frame at 120 Hz
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fervor.emotions import EMOTIONS, SYNONYMS

RATE_HZ = 120.0
"""Frames a second of every recording."""

ACTORS = ("AnBh", "DiMi", "HeGa", "LeSt", "MaMa", "NoVo", "PaPi", "SiGl")
"""The eight actors' codes."""

KNOWN_BAD = frozenset({"SiGl_nv_al_shame_21275-21992", "PaPi_0509_nv_al_t2_sadness_15737-16254"})
"""Recordings that readers of the data set have found to be broken."""

_CODE = re.compile(r"([A-Z][a-z][A-Z][a-z])(?=_|$)")
_TIMES = re.compile(r"_(\d+)_(\d+)_(\d+)_([A-Za-z]+)$")
_FRAMES = re.compile(r"_([A-Za-z]+)_(\d+)-(\d+)$")


@dataclass(frozen=True, slots=True)
class NameParts:
    """What a file name says; None where it does not."""

    actor: str | None
    emotion: str | None
    seconds: float | None


def parts_of(name: str) -> NameParts:
    """What the name of a recording says."""
    code = _CODE.match(name)
    actor = code[1] if code else None
    if found := _TIMES.search(name):
        return NameParts(actor, _emotion(found[4]), int(found[3]) / 1000.0)
    if found := _FRAMES.search(name):
        return NameParts(actor, _emotion(found[1]), (int(found[3]) - int(found[2])) / RATE_HZ)
    return NameParts(actor, None, None)


def _emotion(word: str) -> str | None:
    name = word.lower()
    name = SYNONYMS.get(name, name)
    return name if name in EMOTIONS else None


def usual_code(pairs: Iterable[tuple[str | None, str | None]]) -> Mapping[str, str]:
    """For each value of the actor column, the code that file names most often go with it.

    The column may hold the codes themselves, or other names for the same people.
    """
    seen: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for column, code in pairs:
        if column and code:
            seen[column][code] += 1
    return {column: _most_common(column, codes) for column, codes in seen.items()}


def _most_common(column: str, codes: Counter[str]) -> str:
    if column in codes:
        return column  # it is a code itself
    return min(codes, key=lambda code: (-codes[code], code))
