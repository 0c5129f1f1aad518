"""Whose bones a BVH file has: bodies are measured, so two actors with the same bones may be one person."""

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

_OFFSET = re.compile(rb"OFFSET\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def bones_of(file: Path) -> str:
    """A word that files with equal bones share; empty for kinds of files that bring none.

    Raises:
        OSError: the file can't be read.
    """
    if file.suffix.lower() != ".bvh":
        return ""
    tree = re.split(rb"\bMOTION\b", file.read_bytes(), maxsplit=1, flags=re.IGNORECASE)[0]
    try:
        offsets = [f"{float(number):.3f}" for found in _OFFSET.findall(tree) for number in found]
    except ValueError:
        return ""
    return hashlib.sha256(" ".join(offsets).encode()).hexdigest()[:16]


def shared_bones(found: Iterable[tuple[str, str]]) -> list[tuple[str, ...]]:
    """Groups of actors with the same bones, of pairs of actor and bones; none where everybody has the same.

    Where all files have one body, software has put it there, and it says nothing of who moved.
    """
    actors: defaultdict[str, set[str]] = defaultdict(set)
    for actor, bones in found:
        if bones:
            actors[bones].add(actor)
    if len(actors) < 2:
        return []
    return sorted({tuple(sorted(group)) for group in actors.values() if len(group) > 1})
