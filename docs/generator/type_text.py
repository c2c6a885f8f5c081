"""Types of data classes as words for people who read JSON."""

import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Container, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

WORDS = {
    float: "number",
    int: "whole number",
    str: "text",
    bool: "true or false",
    type(None): "null",
    Path: "text",
    object: "any value",
}


@cache
def hints_of(source: type) -> dict[str, str]:
    """Fields of a data class in words."""
    hints = _hints(source)
    return {field.name: type_text(hints.get(field.name, Any)) for field in dataclasses.fields(source)}


def dataclasses_in(source: type, wanted: Container[str] | None = None) -> list[type]:
    """Data classes that the fields of another one hold, all of them or the `wanted` ones."""
    hints = _hints(source)
    fields = [field.name for field in dataclasses.fields(source) if wanted is None or field.name in wanted]
    return [found for name in fields for found in _classes(hints.get(name, Any))]


def type_text(hint: Any) -> str:
    """A type in words.

    Example:
        >>> type_text(tuple[float, float]), type_text(Mapping[str, int] | None)
        ('[number, number]', 'object of whole number by name, or null')
    """
    if hint in WORDS:
        return WORDS[hint]
    if dataclasses.is_dataclass(hint):
        return f"[{hint.__name__}](#part-{hint.__name__.lower()})"  # type: ignore[union-attr]
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Literal:
        return " or ".join(f"`{value}`" for value in arguments)
    if origin in (typing.Union, types.UnionType):
        return ", or ".join(type_text(argument) for argument in arguments)
    if origin is tuple and not (len(arguments) == 2 and arguments[1] is ...):
        return f"[{', '.join(type_text(argument) for argument in arguments)}]"
    if origin in (tuple, list, Sequence):
        return f"list of {type_text(arguments[0])}"
    if origin in (dict, Mapping):
        return f"object of {type_text(arguments[1])} by name"
    return "any value" if hint is Any else getattr(hint, "__name__", str(hint))


def text_of(source: type) -> str:
    """The text of a class; a list of its fields becomes a list."""
    text = inspect.getdoc(source) or ""
    text = re.sub(r"\nArgs:\n", "\n\n", text)
    text = re.sub(r"^    ([\w, ]+): ", r"* `\1`: ", text, flags=re.MULTILINE)
    return re.sub(r"\n\s+", "\n", text).replace("\n* ", "\n\n* ", 1)


def _hints(source: type) -> dict[str, Any]:
    try:
        return typing.get_type_hints(source)
    except NameError:  # a type that is imported for type checkers only
        return {}


def _classes(hint: Any) -> list[type]:
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return [hint]
    return [found for argument in typing.get_args(hint) for found in _classes(argument)]
