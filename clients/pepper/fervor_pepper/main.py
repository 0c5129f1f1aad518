"""The console entry point of `fervor-pepper`: tells what went wrong in one sentence with an exit code (sysexits.h)."""

import sys

INTERRUPTED = 130
UNAVAILABLE = 69


def main() -> None:
    """Run the program."""
    try:
        from fervor_pepper.program import run_program

        run_program()
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("fervor"):
            raise
        _give_up(f'this needs {error.name}, which is not installed: pip install "fervor[pepper]"', UNAVAILABLE)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _give_up(sentence: str, exit_code: int) -> None:
    sys.stderr.write(f"fervor-pepper: {sentence}\n")
    sys.exit(exit_code)
