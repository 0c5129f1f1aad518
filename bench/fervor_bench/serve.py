"""`fervor serve` in a process of its own: the program itself, as its console script runs it."""

import sys

from fervor.cli.main import main

if __name__ == "__main__":
    sys.argv.insert(1, "serve")
    main()
