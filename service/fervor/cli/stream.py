"""`fervor stream`: a recording streamed to the service at its own pace, as a sensor would, with a live meter."""

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

import fervor_client
from fervor.cli.local import own_service
from fervor.cli.main import BROKEN_PIPE, INTERRUPTED
from fervor.cli.picture.plot import Plot
from fervor.cli.playing import Take, play
from fervor.cli.recordings import read
from fervor.cli.screens import Complaints, pick_screen, say
from fervor.protocol.messages import Clock, Memory

RETRY_S = 10.0
"""How long a service that went away may take to come back, seconds."""


def stream(
    file: Annotated[Path, typer.Argument(help="A recording: BVH, MVNX, CSV, JSONL or NPZ.", show_default=False)],
    *,
    emotion: Annotated[str | None, typer.Option(help="The emotion that is shown; unknown unless given.")] = None,
    url: Annotated[
        str | None,
        typer.Option(
            help=f"Where the service is. If not given: {fervor_client.DEFAULT_URL}, or one started for this recording."
        ),
    ] = None,
    skeleton: Annotated[
        str | None, typer.Option(help="What it was recorded with: a name, or a JSON file as calibrate writes.")
    ] = None,
    token: Annotated[str | None, typer.Option(envvar="FERVOR_TOKEN", help="For a service that wants one.")] = None,
    body: Annotated[str, typer.Option(help="Name of the person, for the service.")] = "0",
    clock: Annotated[Clock, typer.Option(help="time: poses have times; frames: each is one step.")] = "time",
    memory: Annotated[Memory, typer.Option(help="How a body remembers; staggered is for streams of any length.")] = (
        "staggered"
    ),
    fast: Annotated[bool, typer.Option("--fast", help="As fast as the service answers.")] = False,
    json: Annotated[bool, typer.Option("--json", help="One line of JSON an estimate, nothing else.")] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Over and over, until Ctrl-C.")] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw intensity and poses to this PNG or SVG file, at the end or at Ctrl-C.")
    ] = None,
) -> None:
    """Stream a recording at its own pace and watch the intensity move.

    Estimates go to standard output: as a live meter on a terminal, as plain lines into a pipe or file.
    """
    take = Take.of(read(file, skeleton=skeleton))
    drawing = Plot(plot, take.name) if plot else None

    async def run(address: str) -> None:
        async with fervor_client.connect(
            address,
            emotion=emotion,
            token=token,
            clock=clock,
            memory=memory,
            on_error=Complaints(),
            retry_for=RETRY_S,
        ) as session:
            duration = None if loop else take.duration_s
            frames = take.frames(loop=loop)
            screen = pick_screen(take.name, session.model, duration_s=duration, json=json)
            if drawing:
                frames, screen = drawing.watch(frames), drawing.beside(screen, session.model)
            with screen:
                await play(session, frames, screen, body=body, fast=fast)

    with interruptible(), service_at(url, token) as address, drawing or contextlib.nullcontext():
        if drawing:
            drawing.ask_for_rule(address, token)
        asyncio.run(run(address))


@contextlib.contextmanager
def service_at(url: str | None, token: str | None = None) -> Iterator[str]:
    """The address of a service: the one given, the one on this machine, or one that is started and stopped here."""
    if url is not None or _answers(fervor_client.DEFAULT_URL, token):
        yield url or fervor_client.DEFAULT_URL
        return
    say("no service runs on this machine; starting one for this recording")
    with own_service() as port:
        yield f"ws://127.0.0.1:{port}"


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C and a closed pipe end the command quietly, with the exit codes that shells expect."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(INTERRUPTED) from None
    except BrokenPipeError:
        raise typer.Exit(BROKEN_PIPE) from None


def _answers(url: str, token: str | None) -> bool:
    """Whether a fervor service answers at `url`; what it refuses is for the session itself to tell."""
    try:
        fervor_client.sync.connect(url, token=token, open_timeout=2.0).close()
    except (fervor_client.Unreachable, fervor_client.InputError):
        return False
    except fervor_client.FervorError:
        return True
    return True
