"""A training under way, on disk: everything needed to go on, and of which training it is.

Rules. The file is replaced as a whole: whoever is killed while writing leaves the one before. It holds plain values
only, so loading runs no code. A file of another training is refused, never overwritten.
"""

import os
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import torch

from fervor.errors import InputError
from fervor_export.clip import Clip, digest
from fervor_export.recipe import Recipe

VERSION = 1
"""Of the layout of the file."""

Identity = dict[str, Any]
"""What must be the same for the same bits to come out: names and plain values."""


def identity(clips: Sequence[Clip], validation: Sequence[Clip], recipe: Recipe, *, seed: int) -> Identity:
    """Of which training a state is."""
    return {
        "data": digest(clips),
        "validation data": digest(validation),
        "seed": seed,
        "threads": torch.get_num_threads(),
        "torch": str(torch.__version__),
        **{f"recipe's {name}": value for name, value in asdict(recipe).items()},
    }


def name_of(whose: Identity) -> str:
    """A file name that two trainings share only if their states are interchangeable."""
    return sha256(repr(sorted(whose.items())).encode()).hexdigest()[:16]


@dataclass(frozen=True, slots=True, eq=False)
class TrainingState:
    """What a file of a training under way holds."""

    whose: Identity
    content: Mapping[str, Any]
    """As `Trainer.content` gave it."""

    def save(self, path: Path) -> None:
        """Write to `path`, as a whole or not at all."""
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(path.name + ".part")
        with draft.open("wb") as stream:
            torch.save({"version": VERSION, "whose": self.whose, "content": dict(self.content)}, stream)
            stream.flush()
            os.fsync(stream.fileno())
        draft.replace(path)

    @classmethod
    def load(cls, path: Path, whose: Identity) -> "TrainingState | None":
        """What `save` wrote of this training; None where there is no file.

        Raises:
            InputError: the file is of another training, or is no such file.
        """
        if not path.exists():
            return None
        try:
            kept = torch.load(path, weights_only=True)
            version, saved, content = kept["version"], kept["whose"], kept["content"]
        except (OSError, EOFError, KeyError, TypeError, ValueError, RuntimeError, pickle.UnpicklingError) as error:
            raise InputError(f"{path} can't be read as the state of a training: {error}") from error
        if version != VERSION:
            raise InputError(f"{path} is the state of a training of version {version}; expected {VERSION}")
        if saved != whose:
            raise InputError(
                f"{path} belongs to another training, so this one can't go on there: {_apart(saved, whose)}"
            )
        return cls(whose, content)


def _apart(saved: Identity, whose: Identity) -> str:
    """What differs, in words."""
    names = [name for name in whose | saved if saved.get(name) != whose.get(name)]
    return ", ".join(
        f"other {name}" if "data" in name else f"{name} {saved.get(name)} instead of {whose.get(name)}"
        for name in names
    )
