"""Units: definitions that mean what their names say, and derivatives in the unit of their state per second."""

from collections.abc import Iterator
from math import isclose
from typing import Any

from fmus.checks.subject import FLOATS
from fmus.errors import MisfitError
from fmus.units import BASE_UNITS, SiUnit, si_exponents


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
