"""The paper's augmentation: mirror images and the four phases of a fast recording, made of clips on demand.

Split first: a copy carries its recording's name and its actor, so that a fold can be checked, but it belongs to the
training side alone (Sun et al., section IV-B; with eight copies a clip, a random split leaks in practice always).
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from fervor.skeletons.rig import mirror_pose
from fervor_export.clip import Clip


def augment(clips: Iterable[Clip], *, mirror: bool = True, phases: int = 4) -> list[Clip]:
    """Clips and their copies: all phases of a clip, then the mirror images of these.

    Args:
        clips: of the training side.
        mirror: whether to add mirror images.
        phases: how many phases of each clip to use at most, its own among them; slow recordings have fewer.

    Returns:
        New clips without phases of their own; the order is that of the clips.
    """
    return [copy for clip in clips for copy in _copies(clip, mirror=mirror, phases=phases)]


def _copies(clip: Clip, *, mirror: bool, phases: int) -> Iterator[Clip]:
    plain = [replace(clip, phases=())]
    plain += [
        replace(clip, rotations=phase.rotations, mask=phase.mask, phases=())
        for phase in clip.phases[: max(phases - 1, 0)]
        if len(phase.rotations)
    ]
    yield from plain
    if mirror:
        for copy in plain:
            rotations, mask = mirror_pose(copy.rotations, copy.mask)
            yield replace(copy, rotations=rotations, mask=mask)
