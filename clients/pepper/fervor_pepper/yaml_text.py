"""YAML, with the line of every key: the one file that imports PyYAML, and is imported only where YAML is read."""

from collections.abc import Sequence
from dataclasses import dataclass

import yaml


class NotYaml(ValueError):
    """A text that is no YAML."""

    def __init__(self, problem: str, line: int | None) -> None:
        super().__init__(problem)
        self.line = line
        """From 1; None where it is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """What a text says, and where."""

    content: object
    root: yaml.Node | None

    def line(self, loc: Sequence[int | str]) -> int:
        """The line, from 1, of the innermost key or entry on the way to a place."""
        line, node = 1, self.root
        for step in loc:
            found = _child(node, step)  # None: pydantic's own names of validators are steps too
            line, node = found or (line, node)
        return line


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


def load(text: str) -> Document:
    """Read a text.

    Raises:
        NotYaml: it is none, or says more than plain values.
    """
    try:
        return Document(
            yaml.load(text, Loader=_NoDuplicates),  # noqa: S506  # a SafeLoader
            yaml.compose(text, Loader=_NoDuplicates),
        )
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise NotYaml(error.problem or error.context or "nothing is known of why", line) from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise NotYaml(str(error).splitlines()[0], None) from None


def _child(node: yaml.Node | None, step: int | str) -> tuple[int, yaml.Node] | None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == str(step):
                return key.start_mark.line + 1, value
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        child = node.value[step]
        return child.start_mark.line + 1, child
    return None
