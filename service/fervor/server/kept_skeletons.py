"""Skeletons kept on this service beside the catalogue: calibrations, as `session.calibrated` brought them."""

from pathlib import Path

from pydantic import ValidationError

from fervor.protocol.codec import one_sentence
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.settings import SettingsError
from fervor.skeletons.skeleton import Skeleton


def load_skeletons(folder: Path | None) -> dict[str, Skeleton]:
    """The skeletons in the JSON files of a folder, by the names in them; a later file of a name wins.

    Raises:
        SettingsError: the folder or a file in it can't be used; says which, and why.
    """
    if folder is None:
        return {}
    if not folder.is_dir():
        raise SettingsError(f"setting skeletons: {folder} is not a folder")
    return {kept.name: kept for kept in map(_load, sorted(folder.glob("*.json")))}


def _load(path: Path) -> Skeleton:
    try:
        return SkeletonSpec.model_validate_json(path.read_bytes()).to_skeleton()
    except OSError as error:
        raise SettingsError(f"{path} can't be read as a skeleton: {error.strerror}") from None
    except ValidationError as error:
        raise SettingsError(f"{path} is not a skeleton: {one_sentence(error)}") from None
