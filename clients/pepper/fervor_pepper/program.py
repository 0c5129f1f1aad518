"""`fervor-pepper`: a robot that answers to a recording, or to poses that another program pipes in."""

import contextlib
import logging
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from fervor.cli.playing import Take
from fervor.cli.recordings import find_skeleton, read
from fervor.cli.screens import Complaints
from fervor.errors import FervorError, InputError
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.skeletons.skeleton import Skeleton
from fervor_client import DEFAULT_URL, sync
from fervor_pepper.behaviour import Behaviour, Mode
from fervor_pepper.behaviour_file import default_behaviour, default_text, read_behaviour
from fervor_pepper.companion import Companion
from fervor_pepper.dry_robot import DryRobot
from fervor_pepper.feeding import play, relay
from fervor_pepper.robot import Robot
from fervor_pepper.session_log import SessionLog

FIRST_LOOK_S = 5.0
"""How long the robot may take to answer before poses begin to come; it is looked for on and on in any case."""

app = typer.Typer(name="fervor-pepper", add_completion=False, pretty_exceptions_enable=False)


@dataclass(frozen=True, slots=True)
class Source:
    """Where poses come from."""

    skeleton: str | SkeletonSpec
    take: Take | None
    loop: bool

    def feed(self, companion: Companion) -> None:
        """Feed all there is."""
        if self.take is not None:
            play(companion, self.take.frames(loop=self.loop))
        else:
            relay(companion, sys.stdin, complain=Complaints())


@app.command()
def run(  # noqa: PLR0917  # typer calls it by name
    robot: Annotated[str | None, typer.Option(help="Where the robot is: tcp://pepper.local:9559.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="No robot: print what it would do, with times.")] = False,
    service: Annotated[str, typer.Option(help="Where the service is.")] = DEFAULT_URL,
    token: Annotated[str | None, typer.Option(envvar="FERVOR_TOKEN", help="For a service that wants one.")] = None,
    mode: Annotated[
        Mode, typer.Option(help="none: fillers, whatever is shown; expressive: answers to what is shown.")
    ] = "expressive",
    behaviour: Annotated[
        Path | None, typer.Option(help="What to say and do: a YAML file.", show_default="the packaged one")
    ] = None,
    language: Annotated[
        str | None, typer.Option(help="One of the behaviour's languages.", show_default="the behaviour's own")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of what is chosen at random.")] = None,
    play_file: Annotated[
        Path | None,
        typer.Option("--play", help="Play this recording; without it, frames are read from standard input."),
    ] = None,
    loop: Annotated[bool, typer.Option("--loop", help="Play it over and over, until Ctrl-C.")] = False,
    emotion: Annotated[str | None, typer.Option(help="The emotion that is shown, until a frame says another.")] = None,
    skeleton: Annotated[
        str | None, typer.Option(help="What poses come in: a name, or a JSON file.", show_default="c13")
    ] = None,
    log: Annotated[Path | None, typer.Option(help="Record the session in this CSV file; it is added to.")] = None,
    participant: Annotated[str, typer.Option(help="Code of the participant, for the log.")] = "P00",
    condition: Annotated[
        str | None, typer.Option(help="Name of the condition, for the log.", show_default="the mode")
    ] = None,
    print_behaviour: Annotated[
        bool, typer.Option("--print-behaviour", help="Print the packaged behaviour file and end.")
    ] = False,
) -> None:
    """Let a robot answer to what a person's body shows.

    Poses come from a recording (--play), or line by line as JSON from another program's output.
    """
    if print_behaviour:
        typer.echo(default_text(), nl=False)
        return
    chosen = _behaviour(behaviour, language)
    source = _source(play_file, skeleton, loop=loop)
    with (
        _recorder(log, participant, condition or mode) as recorder,
        _robot(robot, dry_run=dry_run) as body,
        sync.connect(
            service, skeleton=source.skeleton, emotion=emotion, token=token, on_error=Complaints(), retry_for=None
        ) as session,
        Companion(body, session, mode=mode, behaviour=chosen, seed=seed, log=recorder) as companion,
    ):
        source.feed(companion)


def run_program() -> None:
    """Read the arguments, run, and end with an exit code (sysexits.h)."""
    logging.basicConfig(format="fervor-pepper: %(message)s", level=logging.WARNING, stream=sys.stderr)
    try:
        app()
    except FervorError as error:
        sys.stderr.write(f"fervor-pepper: {error.message}\n")
        sys.exit(error.exit_code)


def _behaviour(path: Path | None, language: str | None) -> Behaviour:
    behaviour = default_behaviour() if path is None else read_behaviour(path)
    return behaviour if language is None else behaviour.spoken_in(language)


def _source(path: Path | None, skeleton: str | None, *, loop: bool) -> Source:
    if path is not None:
        return Source("c13", Take.of(read(path, skeleton=skeleton)), loop)
    if sys.stdin.isatty():
        raise InputError("nothing to answer to; expected --play FILE, or frames on standard input")
    known = find_skeleton(skeleton) or "c13"
    return Source(SkeletonSpec.of(known) if isinstance(known, Skeleton) else known, None, loop=False)


@contextlib.contextmanager
def _recorder(path: Path | None, participant: str, condition: str) -> Iterator[SessionLog | None]:
    if path is None:
        yield None
        return
    with contextlib.closing(SessionLog(path, participant=participant, condition=condition)) as log:
        yield log


@contextlib.contextmanager
def _robot(url: str | None, *, dry_run: bool) -> Iterator[Robot]:
    if dry_run:
        yield DryRobot()
        return
    if url is None:
        raise InputError("no robot is named; expected --robot tcp://HOST:9559, or --dry-run")
    from fervor_pepper.qi_robot import Pepper

    with Pepper(url) as pepper:
        pepper.wait(FIRST_LOOK_S)
        yield pepper
