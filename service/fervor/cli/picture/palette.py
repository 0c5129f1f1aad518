"""Colours of pictures. They tell levels apart for the colour-blind too (Okabe & Ito), on light paper and on dark."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Palette:
    """One colour a purpose, `#rrggbb`; those of the paper's side change with the theme of a page."""

    paper: str = "#fefefe"
    ink: str = "#1c1d1f"
    quiet: str = "#5b5f65"
    rule: str = "#d6d9dd"
    ribbon: str = "#eceef1"
    caution: str = "#8a5a00"
    weak: str = "#6f93b8"
    strong: str = "#d9601a"
    odd: str = "#e0a526"


LIGHT = Palette()

DARK = Palette(paper="#16181b", ink="#e6e6e6", quiet="#a8adb3", rule="#3c4046", ribbon="#262a2f", caution="#f0c061")

THEMED = ("paper", "ink", "quiet", "rule", "ribbon", "caution")
"""Colours that a page replaces where its reader wants it dark."""


def between(start: str, end: str, share: float) -> str:
    """The colour that lies `share` of the way from one to another, `#rrggbb`."""
    pairs = [(int(start[at : at + 2], 16), int(end[at : at + 2], 16)) for at in (1, 3, 5)]
    return "#" + "".join(f"{round(a + (b - a) * min(max(share, 0.0), 1.0)):02x}" for a, b in pairs)
