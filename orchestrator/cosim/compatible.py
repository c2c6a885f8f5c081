"""Whether the value of one port can be given to another, and how it is converted on the way."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

from fmus.errors import MisfitError
from fmus.units import SiUnit, after_number, scaling, si_exponents
from orchestrator.cosim.component import FLOATS, INTEGERS, Port
from orchestrator.cosim.system import Connection


@dataclass(frozen=True)
class Transfer:
    """`target = factor * source + offset`, or the value that `mapping` gives.

    `limits` is the range that fits the target where not every value of the source does. `notes` say what a user should
    know, such as a conversion.
    """

    factor: float = 1.0
    offset: float = 0.0
    mapping: Mapping[Any, Any] = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()


def transfer(source: Port, target: Port, connection: Connection) -> Transfer:
    """Check type, variability, unit and range of two ports, and give the conversion.

    Args:
        source: the port whose value is given.
        target: the port that takes it.
        connection: how, with the factors or the mapping that it declares.

    Raises:
        MisfitError: if the value of the source cannot be given to the target; the message does not name the ports.
    """
    if "Clock" in (source.type, target.type):
        _clocks(source, target)
        return Transfer()
    if connection.mapping:
        return Transfer(mapping=_mapping(source, target, connection))
    limits, mapping, notes = _type(source, target)
    if mapping:
        return Transfer(mapping=mapping, notes=tuple(notes))
    factor, offset = 1.0, 0.0
    if source.type in FLOATS and target.type in FLOATS and connection.convert:
        factor, offset, more = _unit(source, target)
        notes += more
    linear = (connection.factor, connection.offset) != (1.0, 0.0)
    if linear and not _numeric(target):
        raise MisfitError(f"factor and offset make no sense for the type {target.type}; use a mapping")
    if linear and target.type not in FLOATS and not (connection.factor.is_integer() and connection.offset.is_integer()):
        raise MisfitError(f"factor {connection.factor:g} and offset {connection.offset:g} give no {target.type}")
    factor, offset = connection.factor * factor, connection.factor * offset + connection.offset
    if linear:
        notes.append(f"times {connection.factor:g}, plus {connection.offset:g}, as the connection says")
    if source.variability == "continuous" and target.variability == "discrete":
        notes.append("a continuous output drives a discrete input: it is sampled at the communication points")
    if _numeric(source):
        _check_ranges(source, target, factor, offset)
    return Transfer(factor, offset, limits=limits, notes=tuple(notes))


def _clocks(source: Port, target: Port) -> None:
    for one, other in ((source, target), (target, source)):
        if one.type != "Clock":
            raise MisfitError(f"the type {one.type} does not fit a clock, {other.name}; connect a clock to it")
    if target.variability != "triggered":
        raise MisfitError(
            f"{target.name} is a {target.variability} clock, which ticks by itself; expected a triggered one"
        )


def unit_of(port: Port) -> SiUnit | None:
    """What the unit of a port means: by the component's own definition, else by its name; None without a unit.

    Raises:
        MisfitError: if the component does not define the unit and the name is not known.
    """
    if port.si is not None:
        return port.si
    return si_exponents(port.unit) if port.unit else None


def unit_scaling(source: Port, target: Port) -> tuple[float, float]:
    """Factor and offset from the unit of one port to that of another; both have one.

    Raises:
        MisfitError: if the dimensions differ, a unit is unknown, or one is a frequency and the other an angular speed.
    """
    if source.unit == target.unit and (source.si is None or target.si is None):
        return 1.0, 0.0
    one, other = unit_of(source), unit_of(target)
    assert one is not None and other is not None
    factor, offset = scaling(source.unit, one, target.unit, other)
    angles = [unit.exponents.get("rad", 0) for unit in (one, other)]
    if angles[0] != angles[1] and any(port.unit.endswith("Hz") for port in (source, target)):
        raise MisfitError(
            f"{source.unit!r} and {target.unit!r} differ by turns and radians, where 1 Hz is 6.2832 rad/s; "
            f"say what is meant with convert = false and a factor"
        )
    return factor, offset


def _numeric(port: Port) -> bool:
    return port.type in FLOATS or port.type in INTEGERS or port.type == "Enumeration"


def _unit(source: Port, target: Port) -> tuple[float, float, list[str]]:
    if not source.unit and not target.unit:
        return 1.0, 0.0, []
    if not source.unit or not target.unit:
        known = source.unit or target.unit
        return 1.0, 0.0, [] if known == "1" else [f"one side has no unit; taken as {known}"]
    factor, offset = unit_scaling(source, target)
    if (factor, offset) == (1.0, 0.0):
        return factor, offset, []
    plus = f", offset {offset:.9g}" if offset else ""
    return factor, offset, [f"{source.unit} to {target.unit}: factor {factor:.9g}{plus}"]


def _type(source: Port, target: Port) -> tuple[tuple[float, float] | None, dict[Any, Any], list[str]]:
    """Limits of the target, pairs of values, and notes."""
    if source.type == target.type == "Enumeration":
        return None, *_enumerations(source, target)
    if source.type == target.type:
        return None, {}, []
    if target.type in FLOATS and _numeric(source):
        if source.type not in FLOATS:
            unit = f", taken as {target.unit}" if target.unit not in ("", "1") else ""
            return None, {}, [f"{source.type} to {target.type}: whole numbers, without a unit{unit}"] if unit else []
        narrow = target.type == "Float32" and source.type == "Float64"
        return None, {}, ["Float64 to Float32: about 7 digits are kept"] if narrow else []
    if target.type in INTEGERS and (source.type in INTEGERS or source.type == "Enumeration"):
        low, high = _span(target)
        one, other = _declared_range(source)
        if low <= one and other <= high:
            return None, {}, []
        return (low, high), {}, [f"{source.type} to {target.type}: values beyond [{low:g}, {high:g}] stop the run"]
    if target.type == "Enumeration" and source.type in INTEGERS:
        return None, {number: number for _, number in target.items}, ["numbers that are no item stop the run"]
    raise MisfitError(_type_advice(source, target))


def _type_advice(source: Port, target: Port) -> str:
    text = f"the type {source.type} does not fit {target.type}"
    if source.type == "Boolean" and _numeric(target):
        return f"{text}; say what is meant, such as mapping = [[false, 0], [true, 1]]"
    if source.type in (*INTEGERS, "Enumeration") and target.type == "Boolean":
        return f"{text}; say what is meant with a mapping, such as [[0, ...], [1, ...]]"
    if source.type in FLOATS and target.type in INTEGERS:
        return f"{text}; round it with a function component"
    return text


def _enumerations(source: Port, target: Port) -> tuple[dict[Any, Any], list[str]]:
    if not source.items or not target.items or dict(source.items) == dict(target.items):
        return {}, []
    there = dict(target.items)
    missing = [name for name, _ in source.items if name not in there]
    if missing:
        raise MisfitError(f"the enumeration of the target has no item {missing[0]!r}; say what is meant with a mapping")
    pairs = {value: there[name] for name, value in source.items}
    if all(one == other for one, other in pairs.items()):
        return {}, []
    return pairs, ["the items of the enumerations have other numbers: they are matched by name"]


def _span(port: Port) -> tuple[float, float]:
    bits = int(port.type.lstrip("UInt"))
    low, high = (0, 2**bits - 1) if port.type.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return float(low), float(high)


def _declared_range(port: Port) -> tuple[float, float]:
    if port.items:
        values = [value for _, value in port.items]
        return float(min(values)), float(max(values))
    low, high = _span(port) if port.type in INTEGERS else (-inf, inf)
    return (
        low if port.minimum is None else max(low, port.minimum),
        high if port.maximum is None else min(high, port.maximum),
    )


def _check_ranges(source: Port, target: Port, factor: float, offset: float) -> None:
    low, high = sorted(factor * limit + offset if factor else offset for limit in _declared_range(source))
    least, most = _declared_range(target)
    if high < least or low > most:
        # Each in its own unit, and none where a port has none.
        raise MisfitError(
            f"no value fits: the source is within {_interval(_declared_range(source), source)}, "
            f"the target within {_interval((least, most), target)}"
        )


def _interval(limits: tuple[float, float], port: Port) -> str:
    return f"[{limits[0]:g}, {limits[1]:g}]{after_number(port.unit)}"


def _mapping(source: Port, target: Port, connection: Connection) -> dict[Any, Any]:
    if (connection.factor, connection.offset) != (1.0, 0.0):
        raise MisfitError("give either a mapping or factor and offset, not both")
    pairs = [(_item(source, one), _item(target, other)) for one, other in connection.mapping]
    if len({one for one, _ in pairs}) != len(pairs):
        raise MisfitError("the mapping gives two values for the same one")
    return dict(pairs)


def _item(port: Port, value: Any) -> Any:
    """A value of a mapping, where items of enumerations can be named."""
    items = dict(port.items)
    if port.type == "Enumeration" and isinstance(value, str):
        if value not in items:
            raise MisfitError(f"the enumeration has no item {value!r}, which the mapping names")
        return items[value]
    wrong = isinstance(value, bool) != (port.type == "Boolean") or isinstance(value, str) != (port.type == "String")
    if wrong:
        raise MisfitError(f"the mapping names {value!r}, which is no {port.type}")
    return value
