"""Units as people write them in headers, in the spelling that the rest of the program reads."""

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import replace

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.table import Table

_SPELLINGS = {
    "°": "deg",
    "deg": "deg",
    "rad": "rad",
    "n*m": "N.m",
    "n.m": "N.m",
    "degree": "deg",
    "degrees": "deg",
    "grad": "deg",
    "radian": "rad",
    "radians": "rad",
    "sec": "s",
    "secs": "s",
    "second": "s",
    "seconds": "s",
    "sek": "s",
    "msec": "ms",
    "millis": "ms",
    "milliseconds": "ms",
    "usec": "us",
    "micros": "us",
    "microseconds": "us",
    "nanos": "ns",
    "minutes": "min",
    "hours": "h",
    "newton": "N",
    "newtons": "N",
    "volt": "V",
    "volts": "V",
    "ampere": "A",
    "amps": "A",
    "amp": "A",
    "meter": "m",
    "meters": "m",
    "kelvin": "K",
    "celsius": "degC",
    "°c": "degC",
    "c": "degC",
    "°f": "degF",
    "nm": "N.m",
    "nmm": "N.mm",
    "mnm": "mN.m",
    "knm": "kN.m",
    "rpm": "rpm",
    "1/min": "rpm",
    "min-1": "rpm",
    "rps": "rad/s",
    "rad/sec": "rad/s",
    "deg/sec": "deg/s",
    "°/s": "deg/s",
    "dps": "deg/s",
    "m/sec": "m/s",
    "mps": "m/s",
    "lpm": "l/min",
    "kph": "km/h",
    "g": "g",
    "-": "1",
    "--": "1",
    "none": "1",
    "normalized": "1",
    "norm": "1",
    "pct": "%",
    "percent": "%",
    "volts/div": "V",
}
_POWERS = str.maketrans(
    {"²": "2", "³": "3", "·": ".", "×": ".", "⋅": ".", "*": ".", "µ": "u", "μ": "u", "Ω": "Ohm", "^": None}
)
_BRACKETED = re.compile(
    r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*(?:\([^()]*\))?)\)|<(?P<angle>[^<>]*)>)\s*$"
)
_SEPARATED = re.compile(r"^(?P<name>.+?)(?:\s+in\s+|\s*,\s*|\s*/\s*|\s+)(?P<unit>\S+)$")
# Behind an underscore only units that are no likely part of a name: x_m is a position, u_a a phase.
_SUFFIXES = frozenset(
    [
        "s",
        "sec",
        "ms",
        "msec",
        "us",
        "usec",
        "ns",
        "min",
        "deg",
        "rad",
        "mdeg",
        "mrad",
        "urad",
        "rpm",
        "N",
        "mN",
        "kN",
        "Nm",
        "mNm",
        "Nmm",
        "kNm",
        "V",
        "mV",
        "A",
        "mA",
        "uA",
        "K",
        "degC",
        "Pa",
        "kPa",
        "MPa",
        "mW",
        "kW",
        "bar",
        "mbar",
        "m",
        "mm",
        "cm",
        "um",
        "kg",
        "g",
        "W",
        "Hz",
        "rad_s",
        "deg_s",
        "m_s",
        "mm_s",
        "rad_per_s",
        "deg_per_s",
        "m_per_s",
        "m_s2",
        "m_per_s2",
        "rad_s2",
        *(f"{amount}_{per}" for amount in ("l", "L", "ml", "mL", "m3", "kg", "g") for per in ("s", "min", "h")),
        "lpm",
        "percent",
        "pct",
        "seconds",
        "millis",
    ]
)
# What no name of a variable has: a header without it may be a name as a whole, such as theta_deg.
_SET_APART = re.compile(r"[\[(</,]| in ")
# Within brackets a blank, a dot or a dash between letters is a product.
_PRODUCT = re.compile(r"(?<=[A-Za-z0-9])[\s·*-](?=[A-Za-z])")
# Behind the name of a time alone: x_h is a height.
_LONG_TIMES = {"h": "h", "hr": "h", "hrs": "h", "hours": "h", "minutes": "min", "d": "d", "days": "d"}
# Names that are a unit of time themselves.
_TIMES = {"millis": "ms", "micros": "us", "seconds": "s", "ms": "ms"}


def read_unit(text: str) -> str | None:
    """Give the unit in this program's spelling; None if the text is none.

    >>> [read_unit(text) for text in ("[°]", "Nm", "rad/sec", "m/s²", "-", "Sensor 4")]
    ['deg', 'N.m', 'rad/s', 'm/s2', '1', None]
    """
    bare = text.strip().strip("[]<>").strip()
    if bare.startswith("(") and bare.endswith(")"):
        bare = bare[1:-1].strip()
    if not bare:
        return None
    lower = bare.lower()
    # Small letters mean something else for some units: nm is a length, m is a metre and M nothing.
    if bare not in ("nm", "c", "g") and lower in _SPELLINGS:
        return _SPELLINGS[lower]
    plain = bare.translate(_POWERS)
    for candidate in (plain, plain.replace("sec", "s").replace("°", "deg").replace("Nm", "N.m").replace("**", "")):
        try:
            conversion(candidate, candidate)
        except MisfitError as error:
            if "zero points" in str(error):
                return candidate
            continue
        return candidate
    return None


def split_header(header: str) -> tuple[str, str | None]:
    """Split the header of a column into what it names and the unit that it states.

    Example:
        >>> split_header("theta [deg]"), split_header("F (N)"), split_header("theta_deg"), split_header("q1")
        (('theta', 'deg'), ('F', 'N'), ('theta', 'deg'), ('q1', None))
        >>> split_header("M (N m)"), split_header("M [kN-m]"), split_header("phi (new)")
        (('M', 'N.m'), ('M', 'kN.m'), ('phi (new)', None))
        >>> split_header("pump_l_min"), split_header("feed_kg_h"), split_header("time_h")
        (('pump', 'l/min'), ('feed', 'kg/h'), ('time', 'h'))
        >>> split_header("Angle, °"), split_header("x_m_s"), split_header("time / ms"), split_header("T / degC")
        (('Angle', 'deg'), ('x', 'm/s'), ('time', 'ms'), ('T', 'degC'))
    """
    text = header.strip()
    if text.lower() in _TIMES:
        return text, _TIMES[text.lower()]
    match = _BRACKETED.match(text)
    if match and (match["square"] or "").isdigit() and "[" in text.split()[-1][1:]:
        return text, None  # an element of an array, alpha[1]
    if match and match["name"]:
        inside = (match["square"] or match["round"] or match["angle"] or "").strip()
        unit = read_unit(inside) or read_unit(_PRODUCT.sub(".", inside))
        if unit is not None:
            return match["name"].strip(), unit
        return (
            (match["name"].strip(), None) if match["name"].strip().lower() in ("time", "t", "millis") else (text, None)
        )
    if "/" in text and " / " not in text and read_unit(text) is not None:
        return text, None  # a unit, and no quantity in its unit such as T / K
    match = _SEPARATED.match(text)
    if match and not match["unit"].isdigit() and (unit := read_unit(match["unit"])) is not None:
        return match["name"].strip(), unit
    return _by_underscore(text)


def without_units(table: Table, kept: Collection[str] = ()) -> Table:
    """Take units that are set apart out of a table's headers, such as that of `x [mm]`; headers that would become alike stay.

    >>> from pathlib import Path
    >>> from orchestrator.measurements.table import read_table
    >>> plain = without_units(read_table(Path("swing.csv"), b"t [ms],phi (deg),T / degC,x_m,q[1]\\n0,1,2,3,4\\n"))
    >>> plain.names, dict(plain.units)
    (('t', 'phi', 'T', 'x_m', 'q[1]'), {'t': 'ms', 'phi': 'deg', 'T': 'degC'})
    """
    split = [
        (name, None) if name in kept or not _SET_APART.search(name) else split_header(name) for name in table.names
    ]
    count = Counter(name for name, _ in split)
    read = [
        (plain, unit) if count[plain] == 1 else (name, None)
        for name, (plain, unit) in zip(table.names, split, strict=True)
    ]
    units = {name: unit for name, unit in read if unit}
    return replace(table, names=tuple(name for name, _ in read), units={**table.units, **units})


def _by_underscore(text: str) -> tuple[str, str | None]:
    parts = text.split("_")
    if len(parts) == 2 and parts[0].lower() in ("time", "t") and parts[1].lower() in _LONG_TIMES:
        return parts[0], _LONG_TIMES[parts[1].lower()]
    for length in (3, 2, 1):
        if len(parts) <= length:
            continue
        suffix = "_".join(parts[-length:])
        if suffix in _SUFFIXES:
            unit = read_unit(suffix.replace("_per_", "/").replace("_", "/"))
            if unit is not None:
                return "_".join(parts[:-length]), unit
    return text, None
