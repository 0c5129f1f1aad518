"""`make bench`: a frame's cost inside the service, training's cost, then the service beside a naive one and the floor.

Quickly: `fervor bench` does the last part at length.
"""

import sys

from rich.console import Console

from bench.training import loading, training
from fervor.cli.main import run
from fervor_bench.frame_cost import frame_costs
from fervor_bench.workers import worker_gains

if __name__ == "__main__":
    for table in (*frame_costs(), training(), loading(), worker_gains()):
        Console().print(table)
    sys.exit(run(["bench", "--quick", *sys.argv[1:]]))
