"""Messages made from fields that are known to be right: validating them again costs more than all else about them."""

from typing import Any, TypeVar

from pydantic import BaseModel

M = TypeVar("M", bound=BaseModel)


def trusted(kind: type[M], fields: dict[str, Any]) -> M:
    """A message that is equal to `kind(**fields)`, made without a look at them.

    As `model_construct`, at a fifth of its cost: nothing is filled in.

    Args:
        kind: of message; without private attributes or validators that change a value.
        fields: all of its fields, in their order and of their exact types. The message keeps this dict.
    """
    message = kind.__new__(kind)
    put = object.__setattr__
    put(message, "__dict__", fields)
    put(message, "__pydantic_fields_set__", set(fields))
    put(message, "__pydantic_extra__", None)
    put(message, "__pydantic_private__", None)
    return message
