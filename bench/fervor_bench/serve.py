"""`fervor serve` in a process of its own: the program itself, as its console script runs it.

    python -m fervor_bench.serve PAUSES [OPTION]...

Beside it, the process notes the pauses of its collector in the file PAUSES, and lets a sampler look at its stack.
"""

import sys
from pathlib import Path

from fervor.cli.main import main
from fervor_bench.pauses import note_pauses
from fervor_bench.stages import allow_sampling

if __name__ == "__main__":
    note_pauses(Path(sys.argv[1]))
    allow_sampling()
    sys.argv[1] = "serve"
    main()
