"""What a model description says of its variables: names, terminals and units that keep to FMI and to each other."""

import re
from collections.abc import Iterator
from math import isclose
from pathlib import Path
from typing import Any

from fmus.archive import check_xml
from fmus.checks.subject import FLOATS
from fmus.errors import FmuError, MisfitError
from fmus.terminals import FILE
from fmus.units import BASE_UNITS, SiUnit, si_exponents

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


def check_units(description: Any) -> Iterator[str]:
    """Findings about the units of a model description, one line each."""
    defined = {unit.name: _definition(unit) for unit in description.unitDefinitions}
    for name, si in defined.items():
        known = _known(name)
        if si is not None and known is not None and not _agree(si, known):
            yield f"unit {name!r} is defined as {_words(si)}, but means {_words(known)}"
    for variable in description.modelVariables:
        if variable.type not in FLOATS:
            continue
        unit = _unit_of(variable)
        if variable.causality in ("input", "output") and unit in defined and not (defined[unit] or _known(unit)):
            yield f"the unit {unit!r} of {variable.causality} {variable.name!r} is neither defined in SI units nor known"
        if variable.derivative is not None:
            yield from _derivative(variable, defined)


def _derivative(variable: Any, defined: dict[str, SiUnit | None]) -> Iterator[str]:
    one, state = _unit_of(variable), _unit_of(variable.derivative)
    rate, base = (defined.get(unit) or (_known(unit) if unit else None) for unit in (one, state))
    if rate is None or base is None:
        return
    expected = SiUnit({**base.exponents, "s": base.exponents.get("s", 0) - 1}, base.factor)
    if not _agree(rate, expected):
        yield f"{variable.name!r} has the unit {one!r}, but is the derivative of {variable.derivative.name!r} in {state!r}"


def _unit_of(variable: Any) -> str:
    declared = variable.declaredType
    return str(variable.unit or (declared.unit if declared is not None else None) or "")


def _definition(unit: Any) -> SiUnit | None:
    base = unit.baseUnit
    if base is None:
        return None
    exponents = {name: int(getattr(base, name) or 0) for name in BASE_UNITS}
    return SiUnit({n: e for n, e in exponents.items() if e}, float(base.factor or 1.0), float(base.offset or 0.0))


def _known(name: str) -> SiUnit | None:
    try:
        return si_exponents(name)
    except MisfitError:  # a unit may have any name; only what we can read is checked
        return None


def _agree(one: SiUnit, other: SiUnit) -> bool:
    dimensions = [{base: power for base, power in unit.dimension.items() if power} for unit in (one, other)]
    return dimensions[0] == dimensions[1] and isclose(one.factor, other.factor, rel_tol=1e-6)


def _words(unit: SiUnit) -> str:
    powers = ".".join(f"{base}{power}" for base, power in unit.exponents.items()) or "1"
    return powers if unit.factor == 1.0 else f"{unit.factor:g} {powers}"
