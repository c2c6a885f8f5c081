"""Terminals: valid by the schema of FMI 3.0, and made of variables that exist."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fmus.archive import check_xml
from fmus.errors import FmuError
from fmus.terminals import FILE


def check_terminals(folder: Path, description: Any) -> Iterator[str]:
    """Findings about the terminals of an unpacked FMU, one line each; nothing if it has none."""
    import fmpy  # type: ignore[import-untyped]
    from lxml import etree  # type: ignore[import-untyped]

    path = folder / FILE
    if not path.is_file():
        return
    try:
        check_xml(path.read_bytes(), FILE)
    except FmuError as error:
        yield str(error)
        return
    schema = etree.XMLSchema(file=Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd")
    root = etree.fromstring(path.read_bytes())
    if description.fmiVersion.startswith("3") and not schema.validate(root):
        first = schema.error_log[0]
        yield f"{FILE}:{first.line}: {' '.join(first.message.split())}"
        return
    names = {variable.name for variable in description.modelVariables}
    for terminal in root.iter("Terminal"):
        for member in terminal.iterfind("TerminalMemberVariable"):
            if member.get("variableName") not in names:
                yield f"terminal {terminal.get('name')!r} names {member.get('variableName')!r}, which is no variable"
