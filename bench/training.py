"""Prints how near training comes to this machine's matrix products, and what the paper's experiment costs here.

    python -m bench.training

A slice of the paper's setting (12,000 sequences of 107 frames on average, batches of 256, 100 epochs) is trained for
one epoch, by the code that trains all; figures of the whole are scaled. Matrix products are timed in turn with it, one
thread each, in processor time, of which other programs take none. FLOPs are counted by hand: of the two LSTMs, forward
and backward, of frames that clips have; padding counts as time and not as work.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from fervor_export.batches import GROUP
from fervor_export.clip import Clip
from fervor_export.data.cache import Ask
from fervor_export.data.loading import load_motions
from fervor_export.features import width
from fervor_export.network import NetworkConfig
from fervor_export.recipe import PAPER
from fervor_export.trainer import Trainer

sys.path.append(str(Path(__file__).parents[1] / "tests"))  # whose writer makes files of EBMDB's shape
from datasets import motion, write_bvh

SEQUENCES, FRAMES = 12_000, 107
"""Of the paper's training set, and of a sequence on average."""

SLICE = 2048
"""Sequences trained here: one pool of batches."""

RECORDINGS, FILES = 1447, 24
"""Of EBMDB, and read here."""

ROUNDS = 3

LARGE = (1024, 1024, 1024)


def main() -> None:
    """Run all and print two tables."""
    console = Console()
    console.print(training())
    console.print(loading())


def flops_per_frame(config: NetworkConfig) -> int:
    """Of training: two products an LSTM (input and state), each once forward and twice backward."""
    inputs = ((width(config.features), config.hidden1), (config.hidden1, config.hidden2))
    forward = sum(2 * 4 * hidden * (seen + hidden) for seen, hidden in inputs)
    return 3 * forward


def training() -> Table:
    """One epoch of a slice beside matrix products of its sizes."""
    torch.set_num_threads(1)
    clips = [_clip(number) for number in range(SLICE)]
    trainer = Trainer(clips, [], PAPER, 0)
    assert trainer.prepared is not None
    frames = sum(clip.frames for clip in clips)
    batches = trainer.prepared.batches(seed=0, epoch=1)
    padded = sum(group.target.numel() for batch in batches for group in batch.groups())
    config = trainer.network.config
    sizes = {
        "state of LSTM 1": (GROUP, config.hidden1, 4 * config.hidden1),
        "state of LSTM 2": (GROUP, config.hidden2, 4 * config.hidden2),
        "input of LSTM 1": (GROUP * FRAMES, width(config.features), 4 * config.hidden1),
        "input of LSTM 2": (GROUP * FRAMES, config.hidden1, 4 * config.hidden2),
        "large": LARGE,
    }
    epochs, rates = [], {name: [] for name in sizes}
    for _ in range(ROUNDS):
        epochs.append(_took(lambda: trainer.epoch(lambda _: None)))
        for name, size in sizes.items():
            rates[name].append(_sgemm(*size))
    achieved = frames * flops_per_frame(config) / min(epochs) / 1e9
    table = Table(title=f"training, recipe {PAPER.name}: {achieved:.1f} GFLOP/s, one core")
    for heading in ("matrix product", "size", "GFLOP/s", "training has of it"):
        table.add_column(heading, justify="right")
    for name, size in sizes.items():
        best = max(rates[name])
        table.add_row(name, " x ".join(map(str, size)), f"{best:.1f}", f"{achieved / best:.0%}")
    whole = min(epochs) * SEQUENCES * FRAMES / frames
    table.caption = (
        f"{padded / frames - 1:.1%} of the frames are padding. {SEQUENCES:,} sequences of {FRAMES} frames: "
        f"{60 / whole:.2f} epochs a minute, {PAPER.epochs} epochs in {PAPER.epochs * whole / 60:.0f} min"
    )
    return table


def loading() -> Table:
    """Files of EBMDB's size, read and then taken from the cache."""
    table = Table(title=f"{RECORDINGS:,} recordings as BVH, 120 Hz, 72 channels, {FRAMES / 30:.1f} s, one process")
    for heading in ("", "ms a file", f"s for {RECORDINGS:,}"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{number}.bvh" for number in range(FILES)]
        asked = [Ask(write_bvh(path, motion(seconds=FRAMES / 30, seed=seed))) for seed, path in enumerate(files)]
        cache = Path(folder) / "cache"
        for name in ("cold", "cached"):
            each = _took(lambda: load_motions(asked, cache=cache, processes=1)) / FILES
            table.add_row(name, f"{each * 1e3:.1f}", f"{each * RECORDINGS:.1f}")
    return table


def _clip(number: int) -> Clip:
    """Some motion as long as EBMDB's are: what moves in it costs nothing more or less."""
    random = np.random.default_rng(number)
    frames = int(np.clip(random.lognormal(np.log(FRAMES) - 0.08, 0.4), 20, 600))
    rotations = random.standard_normal((frames, 13, 4)).astype(np.float32) * 0.2
    rotations[..., 3] += 1.0
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    return Clip(rotations, np.ones((frames, 13), np.bool_), "joy", float(random.random()), "actor", f"{number}")


def _sgemm(rows: int, inner: int, columns: int) -> float:
    """GFLOP/s of a float32 product [rows, inner] x [inner, columns]."""
    flops = 2 * rows * inner * columns
    times = max(1, int(1e9 / flops))
    left, right, out = torch.rand(rows, inner), torch.rand(inner, columns), torch.empty(rows, columns)
    return flops * times / _took(lambda: [torch.mm(left, right, out=out) for _ in range(times)]) / 1e9


def _took(work: Callable[[], object]) -> float:
    """Processor time, s."""
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    main()
