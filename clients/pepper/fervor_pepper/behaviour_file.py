"""Behaviour files: YAML that a user edits, read with errors that name the line and the key."""

from functools import cache
from importlib.resources import files
from pathlib import Path

from pydantic import ValidationError

from fervor.errors import InputError
from fervor.protocol.codec import one_sentence
from fervor_pepper.behaviour import Behaviour

DEFAULT = "behaviour.yaml"
"""The behaviour that comes with the package, in five languages."""


class BehaviourError(InputError):
    """A behaviour file that can't be used."""

    code = "bad_behaviour"


@cache
def default_behaviour() -> Behaviour:
    """The behaviour that comes with the package: the paper's lines, in English unless told otherwise."""
    return parse_behaviour(default_text(), DEFAULT)


def default_text() -> str:
    """The packaged file, to begin one's own with."""
    return (files("fervor_pepper") / DEFAULT).read_text(encoding="utf-8")


def read_behaviour(path: Path) -> Behaviour:
    """The behaviour in a file.

    Raises:
        BehaviourError: it can't be read or used; says in which line.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise BehaviourError(f"{path}: can't be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise BehaviourError(f"{path}: is not text in UTF-8") from None
    return parse_behaviour(text, str(path))


def parse_behaviour(text: str, name: str) -> Behaviour:
    """The behaviour that a text says; `name` is for errors.

    Raises:
        BehaviourError: the text is no YAML, or says something that behaviours don't have.
    """
    from fervor_pepper.yaml_text import NotYaml, load  # PyYAML comes with the extra; the core does without

    try:
        document = load(text)
    except NotYaml as error:
        place = "" if error.line is None else f", line {error.line}"
        raise BehaviourError(f"{name}{place}: not YAML: {error}") from None
    try:
        return Behaviour.model_validate(document.content)
    except ValidationError as error:
        line = document.line(error.errors()[0]["loc"])
        sentence = one_sentence(error).replace("a field of this message", "a key of behaviours")
        raise BehaviourError(f"{name}, line {line}: {sentence.replace('the message', 'the file')}") from None
