"""`fervor serve` in a process of its own: the program itself, as its console script runs it."""

import sys

from fervor.cli.main import run

if __name__ == "__main__":
    sys.exit(run(["serve", *sys.argv[1:]]))
