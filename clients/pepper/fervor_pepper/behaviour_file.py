"""Behaviour files: YAML that a user edits, read with errors that name the line and the key."""

from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

import yaml
from pydantic import ValidationError

from fervor.errors import InputError
from fervor.protocol.codec import one_sentence
from fervor_pepper.behaviour import Behaviour

DEFAULT = "behaviour.yaml"
"""The behaviour that comes with the package, in five languages."""


class BehaviourError(InputError):
    """A behaviour file that can't be used."""

    code = "bad_behaviour"


class _NoDuplicates(yaml.SafeLoader):
    """Refuses a key that stands twice in one mapping; YAML forbids it, and PyYAML would drop the first."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[object, object]:
        seen: set[object] = set()
        for key, _ in node.value:
            name = self.construct_object(key, deep=True)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"{name} stands here twice", key.start_mark)
            seen.add(name)
        return super().construct_mapping(node, deep)


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
    try:
        root = yaml.compose(text, Loader=_NoDuplicates)
        said = yaml.load(text, Loader=_NoDuplicates)  # noqa: S506  # a SafeLoader
    except yaml.MarkedYAMLError as error:
        place = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise BehaviourError(f"{name}{place}: not YAML: {error.problem or error.context}") from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise BehaviourError(f"{name}: not YAML: {str(error).splitlines()[0]}") from None
    try:
        return Behaviour.model_validate(said)
    except ValidationError as error:
        line = _line(root, error.errors()[0]["loc"])
        sentence = one_sentence(error).replace("a field of this message", "a key of behaviours")
        raise BehaviourError(f"{name}, line {line}: {sentence.replace('the message', 'the file')}") from None


def _line(node: yaml.Node | None, loc: Sequence[int | str]) -> int:
    """The line, from 1, of the innermost node on the way to what a complaint is about."""
    line = 1
    for step in loc:
        found = _child(node, step)  # None: pydantic's own names of validators are steps too
        line, node = found or (line, node)
    return line


def _child(node: yaml.Node | None, step: int | str) -> tuple[int, yaml.Node] | None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == str(step):
                return key.start_mark.line + 1, value
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        child = node.value[step]
        return child.start_mark.line + 1, child
    return None
