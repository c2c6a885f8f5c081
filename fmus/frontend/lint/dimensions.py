"""Dimensions of expressions: exponents of the SI base units, or that they are not known."""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from fmus.errors import MisfitError
from fmus.units import BASE_UNITS, si_exponents


@dataclass(frozen=True)
class Dimension:
    """Exponents of kg, m, s, A, K, mol, cd; rad counts as 1."""

    powers: tuple[Fraction, ...]

    def times(self, other: "Dimension", power: int = 1) -> "Dimension":
        """Dimension of a product with a power of another quantity."""
        return Dimension(tuple(a + power * b for a, b in zip(self.powers, other.powers, strict=True)))

    def to_the(self, power: Fraction) -> "Dimension":
        """Dimension of a power."""
        return Dimension(tuple(a * power for a in self.powers))

    def __str__(self) -> str:
        named = [(base, power) for base, power in zip(_BASES, self.powers, strict=True) if power]
        return ".".join(base if power == 1 else f"{base}{power}" for base, power in named) or "1"


@dataclass(frozen=True)
class Unknown:
    """No statement about the dimension; fits everything, and makes every product unknown."""


@dataclass(frozen=True)
class PlainNumber:
    """A number such as 2 or 0.5, or a count: dimensionless as a factor, and fits everything in a sum."""


Known = Dimension | Unknown | PlainNumber
UNKNOWN, PLAIN = Unknown(), PlainNumber()
_BASES = tuple(base for base in BASE_UNITS if base != "rad")
ONE = Dimension((Fraction(0),) * len(_BASES))
SECOND = Dimension(tuple(Fraction(base == "s") for base in _BASES))


def of_unit(unit: str | None) -> Known:
    """Dimension of a unit string; a missing unit says nothing.

    Raises:
        MisfitError: for an unknown unit.
    """
    if not unit:
        return UNKNOWN
    found = si_exponents(unit).dimension
    return Dimension(tuple(Fraction(found.get(base, 0)) for base in _BASES))


def is_one_of(unit: str | None, of: Iterable[str]) -> bool:
    """Whether a unit means the same as one of several; one that nobody knows, of an FMU, does not."""
    try:
        return of_unit(unit) in map(of_unit, of)
    except MisfitError:
        return False


def of_number(value: float) -> Known:
    """A whole or half number is a factor of a formula; any other one may stand for a constant with a unit."""
    if value == 0:
        return UNKNOWN
    return PLAIN if float(2 * value).is_integer() else UNKNOWN


def product(left: Known, right: Known, power: int = 1) -> Known:
    """Dimension of `left * right^power`."""
    if isinstance(left, Unknown) or isinstance(right, Unknown):
        return UNKNOWN
    if isinstance(left, PlainNumber) and isinstance(right, PlainNumber):
        return PLAIN
    return _plain_as_one(left).times(_plain_as_one(right), power)


def common(dimensions: Iterable[Known]) -> Known:
    """Dimension of equal quantities, if any of them tells it; else a plain number only if all are."""
    found = list(dimensions)
    known = [d for d in found if isinstance(d, Dimension)]
    if known:
        return known[0]
    return PLAIN if found and all(isinstance(d, PlainNumber) for d in found) else UNKNOWN


def differ(dimensions: Iterable[Known]) -> bool:
    """Tell whether quantities that should be alike have different known dimensions."""
    return len({d for d in dimensions if isinstance(d, Dimension)}) > 1


def _plain_as_one(dimension: Known) -> Dimension:
    return dimension if isinstance(dimension, Dimension) else ONE
