"""Typed reading of TOML values, where a wrong one is named with the file and the key, and writing of them."""

import json
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from fmus.errors import MisfitError
from orchestrator.measurements.wording import nearest, shown


@dataclass(frozen=True)
class TomlTable:
    """One table of a TOML file; `where` names the file and the table in messages.

    Every `get_...` returns None (or an empty text or mapping) for an absent key and raises MisfitError for
    a value of another kind.
    """

    where: str
    values: Mapping[str, Any]

    @classmethod
    def parse(cls, path: Path, content: bytes) -> Self:
        """Read a whole file.

        Raises:
            MisfitError: the content is no TOML in UTF-8; the message keeps the parser's line.
        """
        try:
            return cls(str(path), tomllib.loads(content.decode("utf-8-sig")))
        except UnicodeDecodeError as error:
            raise MisfitError(
                f"{path}: byte 0x{content[error.start]:02x} at position {error.start} is not UTF-8 text; save the file in UTF-8"
            ) from error
        except (ValueError, RecursionError) as error:
            reason = " ".join(str(error).split())
            raise MisfitError(f"{path}: not valid TOML: {reason}") from error

    def get_table(self, key: str) -> "TomlTable":
        """A sub-table, empty when absent."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(key, "a table")
        return TomlTable(f"{self.where} [{key}]", value)

    def texts(self) -> dict[str, str]:
        """The whole table, all of whose values have to be strings."""
        for key, value in self.values.items():
            if not isinstance(value, str):
                raise self.wrong(key, "a string in quotation marks")
        return dict(self.values)

    def get_text(self, key: str) -> str:
        """A string, empty when absent."""
        value = self.values.get(key, "")
        if not isinstance(value, str):
            raise self.wrong(key, "a string in quotation marks")
        return value

    def get_texts(self, key: str) -> tuple[str, ...] | None:
        """A list of strings."""
        values = self._get_list(key, "a list of strings")
        if values is None:
            return None
        if not all(isinstance(value, str) for value in values):
            raise self.wrong(key, "a list of strings")
        return tuple(values)

    def get_positions(self, key: str, names: Sequence[str]) -> tuple[int, ...] | None:
        """A list of positions in `names`, counted from 1, each written as a number or as the name itself."""
        wanted = f"a list of trial numbers, such as [1, 2], or of names in files, such as {shown(list(names[:1]))}"
        values = self._get_list(key, wanted)
        if values is None:
            return None
        positions = [names.index(value) + 1 if value in names else value for value in values]
        if not all(type(position) is int for position in positions):
            raise self.wrong(key, wanted)
        return tuple(positions)

    def get_window(self, key: str) -> tuple[float, float] | None:
        """A pair `[start, stop]` of finite numbers with start < stop."""
        wanted = "two numbers [start, stop] in s with start < stop"
        values = self._get_list(key, wanted)
        if values is None:
            return None
        limits = [number(value) for value in values]
        if len(limits) != 2 or limits[0] is None or limits[1] is None:
            raise self.wrong(key, wanted)
        if limits[0] >= limits[1]:
            raise self.wrong(key, wanted)
        return limits[0], limits[1]

    def get_number(self, key: str) -> float | None:
        """A finite number."""
        value = number(self.values[key]) if key in self.values else None
        if value is None and key in self.values:
            raise self.wrong(key, "a finite number")
        return value

    def get_positive(self, key: str) -> float | None:
        """A finite number above zero."""
        if key not in self.values:
            return None
        value = number(self.values[key])
        if value is None or value <= 0.0:
            raise self.wrong(key, "a number above 0")
        return value

    def get_flag(self, key: str) -> bool | None:
        """True or false."""
        value = self.values.get(key)
        if value is not None and not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def check_keys(self, known: Iterable[str]) -> None:
        """Raise MisfitError for a key that is not known; the message says which was probably meant."""
        names = list(known)
        for key in self.values:
            if key not in names:
                raise MisfitError(f"{self.where}: unknown key {shown(key)}; {nearest(key, names)}")

    def wrong(self, key: str, expected: str) -> MisfitError:
        """The error for a value that is not what was expected."""
        return MisfitError(f"{self.where}: {shown(key)} = {shown(self.values[key])}, expected {expected}")

    def _get_list(self, key: str, expected: str) -> list[Any] | None:
        value = self.values.get(key)
        if value is not None and not isinstance(value, list):
            raise self.wrong(key, expected)
        return value


def number(value: object) -> float | None:
    """A finite TOML number as a float; None for anything else, such as true, nan or "1"."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        converted = float(value)
    except OverflowError:
        return None
    return converted if math.isfinite(converted) else None


def toml_pairs(table: Mapping[str, Any]) -> list[str]:
    """Write a table, a line for each key.

    Example:
        >>> toml_pairs({"q 1": "rad", "step": 0.5, "stops": {"low": [1, 2]}})
        ['"q 1" = "rad"', 'step = 0.5', 'stops = { low = [1, 2] }']
    """
    return [f"{toml_key(key)} = {toml_literal(value)}" for key, value in table.items()]


def toml_key(key: str) -> str:
    """Write a key, in quotes where it has to be."""
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else toml_literal(key)


def toml_literal(value: Any) -> str:
    """Write a value.

    Raises:
        MisfitError: if TOML has no such values.

    Example:
        >>> import numpy as np
        >>> toml_literal([np.float64(0.5), np.arange(2)])
        '[0.5, [0, 1]]'
    """
    if isinstance(value, Mapping):
        return "{ " + ", ".join(toml_pairs(value)) + " }" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_literal(each) for each in value)}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return repr(value)
    if isinstance(value, float):
        return repr(float(value))  # NumPy's own say their type
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        return toml_literal(value.tolist())
    raise MisfitError(f"{shown(value)} cannot be written as TOML")
