"""`fervor bench`: an entry point of the group `fervor.commands`."""

from pathlib import Path
from typing import Annotated

import typer

from fervor_bench.contestant import CONTESTANTS
from fervor_bench.generator import Arrivals, Loop
from fervor_bench.plan import Encodings

PIPED = 150
"""Columns of tables that no terminal shows."""


def bench(
    url: Annotated[
        str | None, typer.Argument(help="Measure this service alone: ws://HOST:PORT.", show_default=False)
    ] = None,
    *,
    contestants: Annotated[str, typer.Option(help="Whom to start and measure, by commas.")] = ",".join(CONTESTANTS),
    encoding: Annotated[Encodings, typer.Option(help="Of the messages, for those that know several.")] = "both",
    sessions: Annotated[str, typer.Option(help="Numbers of sessions to try, by commas; empty: none.")] = "100",
    seconds: Annotated[float, typer.Option(min=0.2, max=600, help="Measured time of each try.")] = 3.0,
    loop: Annotated[Loop, typer.Option(help="`open`: by schedule; `closed`: next message after the answer.")] = "open",
    arrivals: Annotated[
        Arrivals, typer.Option(help="Open loop: schedules at random phases, or all at once.")
    ] = "random",
    joints: Annotated[int, typer.Option(min=1, help="Joints of a pose: picks a skeleton.")] = 13,
    bodies: Annotated[int, typer.Option(min=1, max=16, help="Bodies in a session.")] = 1,
    frames: Annotated[
        str | None,
        typer.Option(
            help="Frames in a message, by commas: each is tried. 1,6, or 1 with several bodies.", show_default=False
        ),
    ] = None,
    jitter: Annotated[
        float, typer.Option(min=0, max=16, help="How far a frame's time may be off, ms; 0: exactly on the grid.")
    ] = 4.0,
    checkpoints: Annotated[bool, typer.Option(help="A checkpoint a second and body.")] = True,
    lone: Annotated[
        float, typer.Option(min=0, max=600, help="Measured seconds of a session alone; 0: none is measured.")
    ] = 5.0,
    most_sessions: Annotated[
        int, typer.Option(min=0, max=20_000, help="Where the search for the capacity ends; 0: no search.")
    ] = 8000,
    idle: Annotated[int, typer.Option(min=0, max=20_000, help="Idle sessions to take the memory of; 0: none.")] = 1000,
    stages: Annotated[
        bool, typer.Option("--stages", help="Where a frame's time goes, by py-spy, and inside the service.")
    ] = False,
    scoring: Annotated[bool, typer.Option("--scoring", help="Scoring over HTTP, alone and beside sessions.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Rough figures in a minute or two.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for results.md, results.json, plot.png.")] = None,
    token: Annotated[str | None, typer.Option(envvar="FERVOR_TOKEN", help="Token for the service at URL.")] = None,
) -> None:
    """Measure the service beside a naive one and a floor in C, or how many robots a running one carries."""
    from rich.console import Console

    from fervor_bench.plan import QUICK, Plan
    from fervor_bench.report import show, write_markdown
    from fervor_bench.run import measure_all, measure_url
    from fervor_bench.traffic import Traffic

    plan = QUICK
    if not quick:
        plan = Plan(
            contestants=tuple(name.strip() for name in contestants.split(",")),
            encoding=encoding,
            traffic=Traffic(joints=joints, bodies=bodies, jitter_s=jitter / 1000.0, checkpoints=checkpoints),
            frames=_numbers(frames or ("1,6" if bodies == 1 else "1"), "--frames", most=1024) or (1,),
            sessions=_numbers(sessions, "--sessions", most=20_000),
            loop=loop,
            arrivals=arrivals,
            seconds=seconds,
            lone_s=lone,
            idle=idle,
            most_sessions=most_sessions,
        )
    with Console(stderr=True).status("measuring") as status:
        if url is not None:
            results = measure_url(url, plan, token=token or "", told=status.update)
        else:
            results = measure_all(plan, stages=stages, scoring=scoring, told=status.update)
    console = Console()
    show(console if console.is_terminal else Console(width=PIPED), results)
    if out is not None:
        from fervor_bench.plot import plot

        out.mkdir(parents=True, exist_ok=True)
        results.write(out / "results.json")
        write_markdown(results, out / "results.md")
        plot(results, out / "plot.png")


def _numbers(text: str, option: str, *, most: int) -> tuple[int, ...]:
    try:
        numbers = tuple(int(part) for part in text.split(",") if part.strip())
    except ValueError:
        numbers = (0,)
    if not all(1 <= number <= most for number in numbers):
        raise typer.BadParameter(f"{text!r}; expected numbers from 1 to {most}, by commas", param_hint=option)
    return numbers
