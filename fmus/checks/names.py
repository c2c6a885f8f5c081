"""Names of variables: whether they are what the naming convention of the description allows (FMI 3.0, section 2.4.7.5)."""

import re
from collections.abc import Iterator
from typing import Any

_PLAIN = r"[_a-zA-Z][_a-zA-Z0-9]*"
_QUOTED = r"""'(?:[_a-zA-Z0-9!#$%&()*+,\-./:;<>=?@\[\]^{}|~ "]|\\['"?\\abfnrtv])+'"""
_PART = rf"(?:{_PLAIN}|{_QUOTED})(?:\[[0-9]+(?:,[0-9]+)*\])?"
_IDENTIFIER = rf"{_PART}(?:\.{_PART})*"
_STRUCTURED = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,[0-9]+)?\)")
_CONTROL = {"\r": "carriage return", "\n": "line feed", "\t": "tab"}


def check_names(description: Any) -> Iterator[str]:
    """One line for each name that does not follow the convention."""
    flat = description.variableNamingConvention == "flat"
    for variable in description.modelVariables:
        name = variable.name
        if flat:
            for character, words in _CONTROL.items():
                if character in name:
                    yield f"the name {name!r} (line {variable.sourceline}) contains a {words}"
        elif not _STRUCTURED.fullmatch(name):
            yield (
                f"{name!r} (line {variable.sourceline}) is no legal name under the naming convention 'structured': "
                "identifiers joined by dots, with indices such as [1,2], or der(...)"
            )
