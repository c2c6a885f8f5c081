"""Mapping files: a table for each component with the new names by the old ones."""

import json
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.swap.report import SwapReport
from orchestrator.measurements.toml_values import TomlTable


def read_mapping(path: Path, component: str) -> dict[str, str]:
    """Read the table of a component; "" leaves a variable out. Without a table of its own nothing is renamed.

    Raises:
        MisfitError: if the file cannot be read or a name is no string.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected a mapping file") from error
    table = TomlTable.parse(path, content)
    for name, value in table.values.items():
        if not isinstance(value, dict):
            raise table.wrong(name, f'a table for each component, such as [{component}] with old = "new"')
    return table.get_table(component).texts()


def mapping_text(report: SwapReport) -> str:
    """Text of a mapping file with every name that differs, to be checked and given back."""
    lines = [f"# {report.old} -> {report.new}", f"[{_key(report.component)}]"]
    for match in report.matches:
        if match.old != match.new:
            remark = "  # by similarity: please check" if match.how == "similar" else ""
            lines.append(f"{_key(match.old)} = {json.dumps(match.new)}{remark}")
    lines += [f'{_key(name)} = ""  # missing: give a name, or leave it out like this' for name, *_ in _wanted(report)]
    return "\n".join(lines) + "\n"


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name, ensure_ascii=False)


def _wanted(report: SwapReport) -> list[tuple[str, str, str, str]]:
    return [each for each in report.missing if each[3]]
