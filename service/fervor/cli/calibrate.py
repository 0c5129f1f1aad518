"""`fervor calibrate`: the alignment of an unknown sensor from a pose that somebody holds in a recording."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydantic import ValidationError

from fervor.cli.recordings import read
from fervor.errors import InputError
from fervor.protocol.codec import one_sentence
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.recordings.recording import Recording
from fervor.skeletons import calibration
from fervor.skeletons.binds import Quaternion
from fervor.skeletons.calibration import Calibration, HeldPose


def calibrate(
    file: Annotated[Path, typer.Argument(help="A recording in which somebody holds a pose.", show_default=False)],
    *,
    pose: Annotated[HeldPose, typer.Option(help="n: arms hanging, palms to the thighs; t: arms straight out.")],
    out: Annotated[Path, typer.Option(help="JSON file to write.", show_default=False)],
    start: Annotated[float, typer.Option(min=0.0, help="Second at which the pose is held.")] = 0.0,
    seconds: Annotated[float, typer.Option(min=0.2, max=10.0, help="How long it is held.")] = 1.0,
    skeleton: Annotated[
        str | None, typer.Option(help="The sensor's joints: a name as in /v1/skeletons, or a JSON file.")
    ] = None,
    up: Annotated[str, typer.Option(metavar="X,Y,Z", help="The person's up, in sensor axes.")] = "0,1,0",
    forward: Annotated[str, typer.Option(metavar="X,Y,Z", help="Where the person faces, in sensor axes.")] = "0,0,1",
    name: Annotated[str | None, typer.Option(help="Of the skeleton; the name of the JSON file unless given.")] = None,
) -> None:
    """Take a sensor's alignment from a held pose, and keep it as JSON.

    Sessions take the JSON as their skeleton, commands as --skeleton, and a service knows it by its name if it lies in
    the folder of `fervor serve --skeletons`.
    """
    person = calibration.facing(_vector("up", up), _vector("forward", forward))
    recording = read(file, skeleton=skeleton)
    found = held_pose(recording, pose=pose, start=start, seconds=seconds, person=person)
    try:
        spec = SkeletonSpec.of(found.skeleton, name=out.stem if name is None else name)
    except ValidationError as error:
        raise InputError(f"{name!r} can't be the name of a skeleton: {one_sentence(error)}") from None
    try:
        out.write_text(spec.model_dump_json(indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{out}: can't be written: {error.strerror or error}") from None
    unseen = ", ".join(found.unseen) or "none"
    typer.echo(f"{found.frames} frames, at most {found.spread_deg:.1f} degrees from the mean, unseen: {unseen}")
    typer.echo(f"{out}: skeleton {spec.name!r} with {len(spec.joints)} joints")


def held_pose(recording: Recording, *, pose: HeldPose, start: float, seconds: float, person: Quaternion) -> Calibration:
    """The alignment from a stretch of a recording, `start` and `seconds` in its own time.

    Raises:
        InputError: the recording is over before, the pose was not held still, or the source needs no alignment.
    """
    times = recording.times
    step = 1.0 / recording.rate_hz if recording.rate_hz else 0.0
    if times[-1] + 1.5 * step < start + seconds:
        end, until = f"{recording.duration_s:.1f} s", f"{start + seconds:g} s"
        raise InputError(f"{recording.name} ends after {end}; expected a pose that is held until {until}")
    held = (times >= start) & (times <= start + seconds)
    return calibration.calibrate(
        recording.skeleton,
        np.ascontiguousarray(recording.rotations[held]),
        recording.observed[held],
        axes=recording.axes,
        pose=pose,
        person=person,
    )


def _vector(option: str, text: str) -> tuple[float, float, float]:
    """Three numbers with commas between them."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--{option} is {text!r}; expected three numbers, like 0,1,0") from None
    return x, y, z
