"""Results of long work, kept under the hash of what they follow from: done once, and then read."""

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def remembered(
    folder: Path | None, causes: tuple[object, ...], make: Callable[[], dict[str, Floats]]
) -> dict[str, Floats]:
    """What `make` gives, to the bit, made once for the same causes.

    Args:
        folder: where results are kept; None: nowhere.
        causes: everything that the result follows from: arrays, or values whose `repr` says all.
        make: numbers [clip] by name.
    """
    if folder is None:
        return make()
    sha = sha256()
    for cause in causes:
        sha.update(np.ascontiguousarray(cause).tobytes() if isinstance(cause, np.ndarray) else repr(cause).encode())
    path = folder / f"{sha.hexdigest()[:16]}.json"
    try:
        return {name: np.asarray(values) for name, values in json.loads(path.read_text(encoding="utf-8")).items()}
    except (OSError, ValueError):
        made = make()
    folder.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + ".part")
    draft.write_text(json.dumps({name: values.tolist() for name, values in made.items()}), encoding="utf-8")
    draft.replace(path)
    return made
