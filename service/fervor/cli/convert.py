"""`fervor convert`: a recording as another kind of file, on the rig. What the source did not see is told."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from fervor.cli.recordings import read
from fervor.errors import RecordingError
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.writer import write_recording
from fervor.rotations import IDENTITY, slerp
from fervor.session.timeline import INTERPOLATE_S, SAME_INSTANT_S
from fervor.skeletons.canonical import C13
from fervor.skeletons.rig import JOINTS


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="BVH, MVNX, CSV, JSONL or NPZ.", show_default=False)],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="BVH, CSV, JSONL or NPZ.", show_default=False)],
    *,
    skeleton: Annotated[
        str | None, typer.Option(help="What IN was recorded with: a name as in /v1/skeletons, or a JSON file.")
    ] = None,
    segments: Annotated[
        Path | None, typer.Option(help="For BVH: a JSON file that says which joint is which rig segment.")
    ] = None,
    rate: Annotated[
        float | None, typer.Option(min=1.0, max=1000.0, help="Frames a second of OUT; those of IN unless given.")
    ] = None,
) -> None:
    """Convert a recording to another kind of file.

    OUT holds the rig's 13 local rotations, whatever IN was recorded with: nothing of the person's size, nor of the
    sensor's place.
    """
    if target.exists() and target.samefile(source):
        raise RecordingError(f"{target}: IN and OUT are the same file; expected two")
    recording = read(source, skeleton=skeleton, segments=segments)
    if rate is not None:
        recording = at_rate(recording, rate)
    write_recording(recording, target)
    typer.echo(summary(recording, target))


def at_rate(recording: Recording, rate_hz: float) -> Recording:
    """A recording on an even grid of `rate_hz`, on the rig, by the rules of a live body.

    A joint is observed between two frames where both show it and they are no more than `INTERPOLATE_S` apart.
    """
    times, local, observed = rig_poses(recording)
    grid = np.arange(int(recording.duration_s * rate_hz + SAME_INSTANT_S) + 1) / rate_hz
    after = np.minimum(np.searchsorted(times, grid - SAME_INSTANT_S), len(times) - 1)  # the first frame not before
    before = np.maximum(after - 1, 0)
    gap = times[after] - times[before]
    share = np.where(gap > 0.0, (grid - times[before]) / np.where(gap > 0.0, gap, 1.0), 1.0)
    arrived = grid >= times[after] - SAME_INSTANT_S
    share = np.where(arrived, 1.0, np.clip(share, 0.0, 1.0))
    seen = observed[after] & (arrived | (gap <= INTERPOLATE_S + SAME_INSTANT_S))[:, None]
    seen &= observed[before] | arrived[:, None]
    turned = slerp(local[before], local[after], share[:, None])
    rotations = np.where(seen[..., None], turned, IDENTITY)
    return Recording(recording.name, C13, grid, rotations, seen, "local")


def summary(recording: Recording, target: Path) -> str:
    """One sentence on what was written, and what of the body it does not show."""
    _, _, observed = rig_poses(recording)
    shares = dict(zip(JOINTS, observed.mean(axis=0).tolist(), strict=True))
    never = [joint for joint, share in shares.items() if share == 0.0]
    partly = [f"{joint} ({share:.0%} of the time)" for joint, share in shares.items() if 0.0 < share < 1.0]
    parts = [f"never seen: {', '.join(never)}"] * bool(never) + [f"seen in part: {', '.join(partly)}"] * bool(partly)
    if parts and target.suffix.lower() == ".bvh":
        parts.append("BVH has no gaps, so they hold their last pose there")
    lost = "; ".join(parts) or f"all {len(JOINTS)} joints seen"
    return f"{target}: {len(recording)} frames in {recording.duration_s:.1f} s at {recording.rate_hz:.4g} Hz; {lost}"
