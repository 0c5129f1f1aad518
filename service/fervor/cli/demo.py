"""`fervor demo`: a service, a person who shows joy, and the meter, with one command."""

import asyncio
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import typer

import fervor_client
from fervor.cli.local import HOST, free_port, is_free, own_service
from fervor.cli.playing import Take, play
from fervor.cli.screens import Complaints, pick_screen, say
from fervor.cli.stream import interruptible
from fervor.recordings.reader import read_recording

SAMPLE = "joy.bvh"
"""The recording that comes with fervor."""

PORT = 8080


def demo(
    file: Annotated[
        Path | None,
        typer.Argument(help="Another recording than the sample that comes with fervor.", show_default=False),
    ] = None,
    emotion: Annotated[str, typer.Option(help="The emotion that is shown.")] = "joy",
    port: Annotated[int, typer.Option(help="Port of the service; another one if it is taken.")] = PORT,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after so much time; until Ctrl-C unless given.")
    ] = None,
) -> None:
    """Start the service, stream a recording to it in a loop, and watch the intensity move."""
    take = read_take(file)

    async def run(url: str) -> None:
        async with fervor_client.connect(url, emotion=emotion, on_error=Complaints()) as session:
            with pick_screen(take.name, session.model, duration_s=None, json=False) as screen:
                await play(session, take.frames(loop=True, seconds=seconds), screen)

    with interruptible(), own_service(pick_port(port)) as taken:
        say(f"the service runs at http://{HOST}:{taken}: open it in a browser to see who moves how")
        say(f"{take.name} streams to it in a loop, as a robot streams who stands before it")
        say(f"bar: share of observers expected to see {emotion}; mark: weak | strong")
        say("Ctrl-C stops both")
        asyncio.run(run(f"ws://{HOST}:{taken}"))


def read_take(file: Path | None) -> Take:
    """The recording to play: `file`, or the sample.

    Raises:
        RecordingError: it can't be read.
    """
    if file is not None:
        return Take.of(read_recording(file))
    with as_file(files("fervor") / "samples" / SAMPLE) as sample:
        return Take.of(read_recording(sample))


def pick_port(wanted: int) -> int:
    """The port to listen on: the one wanted, or a free one where that is taken, which is said."""
    if is_free(wanted):
        return wanted
    other = free_port()
    say(f"port {wanted} is taken; using {other} instead")
    return other
