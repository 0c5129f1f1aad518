"""`make bench`: the cost of a frame inside the service, then the service beside a naive one and the floor, quickly.

`fervor bench` does the second part at length.
"""

import sys

from rich.console import Console

from fervor.cli.main import run
from fervor_bench.frame_cost import frame_costs

if __name__ == "__main__":
    for table in frame_costs():
        Console().print(table)
    sys.exit(run(["bench", "--quick", *sys.argv[1:]]))
