"""Motions that were read before, by their content: `<folder>/v<version>/<key>.npz`, one file each.

Rules. The key is a hash of the file's bytes and of everything that was asked of it, so a changed file is another one
and nothing is ever out of date. `LOADER_VERSION` rises whenever the same bytes would give other motion. Whatever can't
be read back is read anew; a cache that can't be written is done without.
"""

import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from fervor.skeletons.rig import JOINTS
from fervor_export.clip import Phase
from fervor_export.data.motion import Motion

LOADER_VERSION = 2
"""Of how files become motion; part of every key."""


@dataclass(frozen=True, slots=True)
class Ask:
    """A file, and what to take from it."""

    file: Path
    skeleton: str | None = None
    start_s: float | None = None
    end_s: float | None = None

    def key(self) -> str:
        """What the answer is kept under.

        Raises:
            OSError: the file can't be read.
        """
        options = {name: value for name, value in asdict(self).items() if name != "file"}
        with self.file.open("rb") as stream:
            content = hashlib.file_digest(stream, "sha256").hexdigest()
        said = json.dumps([LOADER_VERSION, self.file.suffix.lower(), content, options], sort_keys=True)
        return hashlib.sha256(said.encode()).hexdigest()


def default_cache() -> Path:
    """The user's folder for what can be made again."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fervor" / "motion"


def load(folder: Path, key: str) -> Motion | None:
    """The motion under a key; None where it has to be read."""
    try:
        with _path(folder, key).open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            return _unpack({name: kept[name] for name in kept.files})
    except (OSError, ValueError, KeyError, BadZipFile, EOFError):
        return None


def save(folder: Path, key: str, motion: Motion) -> None:
    """Keep a motion; a reader never sees half of it."""
    path = _path(folder, key)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as stream:
                np.savez(stream, **_pack(motion))  # type: ignore[arg-type]
            Path(part).replace(path)
        finally:
            Path(part).unlink(missing_ok=True)


def _path(folder: Path, key: str) -> Path:
    return folder / f"v{LOADER_VERSION}" / f"{key}.npz"


def _pack(motion: Motion) -> dict[str, npt.NDArray[Any]]:
    """A motion as few arrays: each costs a reader time."""
    return {
        "frames": np.array([len(phase.rotations) for phase in motion.phases]),
        "rotations": np.concatenate([phase.rotations for phase in motion.phases]),
        "masks": np.packbits(np.concatenate([phase.mask for phase in motion.phases])),
        "prints": np.stack([motion.prints, motion.mirrored]),
        "numbers": np.array([motion.poses, motion.t_poses, motion.rate_hz, motion.seconds]),
        "words": np.array([motion.skeleton, motion.doubt, motion.bones]),
    }


def _unpack(arrays: Mapping[str, npt.NDArray[Any]]) -> Motion:
    """What `_pack` packed.

    Raises:
        ValueError: the arrays are not of one motion.
        KeyError: one is missing.
    """
    rotations, cuts = arrays["rotations"], np.cumsum(arrays["frames"])[:-1]
    bits = np.unpackbits(arrays["masks"], count=len(rotations) * len(JOINTS))
    masks = bits.astype(np.bool_).reshape(len(rotations), len(JOINTS))
    prints, mirrored = arrays["prints"]
    poses, t_poses, rate_hz, seconds = arrays["numbers"].tolist()
    skeleton, doubt, bones = arrays["words"].tolist()
    return Motion(
        phases=tuple(map(Phase, np.split(rotations, cuts), np.split(masks, cuts))),
        prints=prints,
        mirrored=mirrored,
        poses=int(poses),
        rate_hz=rate_hz,
        seconds=seconds,
        skeleton=skeleton,
        t_poses=int(t_poses),
        doubt=doubt,
        bones=bones,
    )
