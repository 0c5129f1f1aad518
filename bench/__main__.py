"""`make bench`: a frame's cost inside the service, training's cost, then the service beside a naive one and the floor,
and what a second worker is worth.

Quickly: `fervor bench` does at length what compares services.
"""

import sys

from rich.console import Console

from bench.training import loading, training
from fervor.cli.main import run
from fervor_bench.frame_cost import adapting_costs, measure_inside
from fervor_bench.report import as_table
from fervor_bench.sheets import inside
from fervor_bench.workers import worker_gains

if __name__ == "__main__":
    for table in (as_table(inside(measure_inside())), adapting_costs(), training(), loading()):
        Console().print(table)
    code = run(["bench", "--quick", *sys.argv[1:]])
    if not code:
        Console().print(worker_gains())
    sys.exit(code)
