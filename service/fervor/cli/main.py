"""The `fervor` program: runs a command, and tells what went wrong in one sentence with an exit code (sysexits.h).

Stack traces are for faults of ours only. A closed pipe ends a program quietly, Ctrl-C with 130.
"""

import gc
import os
import sys

from fervor.errors import FervorError

BROKEN_PIPE = 141
"""What a shell shows of a program that a closed pipe ended: 128 + SIGPIPE."""

INTERRUPTED = 130

UNAVAILABLE = 69


def main() -> None:
    """The console entry point."""
    gc.disable()  # until the command is loaded, which leaves next to no garbage
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run the program.

    Args:
        arguments: as typed, without the program's name.

    Returns:
        The exit code.
    """
    try:
        from fervor.cli.commands import MissingExtra, build_app, find_commands, what_is_missing
    except ModuleNotFoundError as error:
        sentence = f'the command line needs {error.name}, which is not installed: pip install "fervor[serve]"'
        return _say(sentence, UNAVAILABLE)
    try:
        build_app(arguments)(arguments, prog_name="fervor")
    except SystemExit as ended:
        return _flushed(ended.code)
    except FervorError as error:
        return _say(error.message, error.exit_code)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return _hang_up()
    except ModuleNotFoundError as error:
        called = find_commands().get(next((word for word in arguments if not word.startswith("-")), ""))
        missing = what_is_missing(error, called)
        if not isinstance(missing, MissingExtra):
            raise
        return _say(missing.message, missing.exit_code)
    return 0


def _say(sentence: str, exit_code: int) -> int:
    sys.stderr.write(f"fervor: {sentence}\n")
    return exit_code


def _flushed(code: str | int | None) -> int:
    """The exit code, once everything written has left; a closed pipe shows only here."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        return _hang_up()
    return code if isinstance(code, int) else 0 if code is None else 1


def _hang_up() -> int:
    """Leave quietly: nobody reads what is still to be written, nor a complaint about it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return BROKEN_PIPE
