"""Check that equations, sums and values have consistent units, on the flat DAE."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from typing import Any

from fmus.errors import MisfitError, ModelicaError
from fmus.frontend.lint.dimensions import (
    ONE,
    PLAIN,
    SECOND,
    UNKNOWN,
    Dimension,
    Known,
    common,
    differ,
    of_number,
    of_unit,
    product,
)
from fmus.symbolic.arena import Arena

# The library that may write constants without their units.
STANDARD = "Modelica"
# Whole numbers up to here count or double something in the value of a parameter; beyond, such as 1.9e6*V, they may be a property.
LARGEST_COUNT = 10.0
_SAME = frozenset(
    (
        "abs",
        "min",
        "max",
        "sum",
        "no_event",
        "floor",
        "ceil",
        "mod",
        "rem",
        "transpose",
        "vector",
        "diagonal",
        "skew",
        "linspace",
    )
)
_OF_NUMBERS = frozenset(("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "log10"))
_ALIKE = frozenset(("add", "subtract", "less", "less_equal", "greater", "greater_equal", "equal", "not_equal"))


def check_units(dae: Mapping[str, Any]) -> list[str]:
    """Refuse equations whose sides, sums whose terms, and values whose units differ whatever unit its numbers have.

    A missing unit and `time` fit everything (a ramp `u = time` is common in tests); so does a number in a sum. As a
    factor a whole or half number is dimensionless, unless only a unit of it would make units agree (`exp((T - 350)/8)`, in the value of a
    parameter `1.9e6*V`): these places are returned.

    Returns:
        What differs unless a number has a unit, as `file:line: what`; in the Modelica Standard Library, which writes some constants as
        plain numbers and is tested by its results, the places of all that differs.

    Raises:
        ModelicaError: `file:line: what differs`.
    """
    check = _UnitCheck(Arena(dae))
    check.values()
    check.equations()
    return check.tolerated


def dimension_of(arena: Arena) -> Callable[[int], Known]:
    """Return what tells the dimension of an expression of a model that has passed the check, by its number."""
    checks = [_UnitCheck(arena), _UnitCheck(arena, units_from=0.0)]

    def dimension(node: int) -> Known:
        for check in checks:
            try:
                return check.dimension(node)
            except ModelicaError:
                continue
        return UNKNOWN

    return dimension


class _UnitCheck:
    """Dimensions of nodes; `place` is the file and line of the equation or declaration at hand.

    Numbers beyond `units_from` may have a unit.
    """

    def __init__(self, arena: Arena, *, units_from: float = float("inf")) -> None:
        self.arena, self.units_from = arena, units_from
        self.place = ""
        self.tolerates = False
        self.tolerated: list[str] = []
        self.known: dict[int, Known] = {}
        self.units = [self._declared(variable) for variable in arena.variables]

    def _declared(self, variable: Mapping[str, Any]) -> Known:
        unit = variable["attributes"]["unit"]
        try:
            found = of_unit(unit)
        except MisfitError as error:
            place = self.arena.where(variable["declaration"])
            raise ModelicaError(f"{place}: {variable['name']} has {error}") from error
        is_real = self.arena.value_type(variable["value_type"])["scalar"] == "real"
        return found if unit or is_real else PLAIN

    def values(self) -> None:
        """Check the values of parameters and the start values of variables against their units."""
        lenient = _UnitCheck(self.arena, units_from=LARGEST_COUNT)
        for variable in self.arena.variables:
            self._go_to(variable["declaration"])
            before = len(self.tolerated)
            for key in ("binding", "start", "min", "max"):
                node = variable["attributes"].get(key)
                if node is not None and len(self.tolerated) == before:  # what is bound starts with the same value
                    self._tolerate(partial(_UnitCheck._value, variable=variable, key=key, node=node), lenient)

    def _value(self, variable: Mapping[str, Any], key: str, node: int) -> None:
        unit, found = self._declared(variable), self.dimension(node)
        if differ((unit, found)):
            self._refuse(f"{variable['name']} has unit {unit}, but its {_WORDS[key]} has unit {found}")

    def equations(self) -> None:
        """Check both sides of every equation."""
        lenient = _UnitCheck(self.arena, units_from=0.0)
        for key in ("continuous_equation_operations", "initialization_equation_operations"):
            for operation in self.arena.storage[key]:
                kind, body = next(iter(operation.items()))
                self._go_to(body["provenance"])
                for node in [body["residual"]] if kind == "residual" else body["bodies"]:
                    self._tolerate(partial(_UnitCheck._sides, node=node), lenient)

    def _tolerate(self, check: Callable[["_UnitCheck"], None], lenient: "_UnitCheck") -> None:
        """Let pass what a unit of a number would explain, and remember it."""
        try:
            check(self)
        except ModelicaError as error:
            try:
                check(lenient)
            except ModelicaError:
                raise error from None
            self.tolerated = list(dict.fromkeys([*self.tolerated, f"{error}, unless a number there has a unit"]))

    def _sides(self, node: int) -> None:
        tag, body = self.arena.node(node)
        if tag == "conditional":
            # The branches of an if-equation are equations of their own, of a voltage here and a current there.
            operands = self.arena.operands(node)
            for condition in operands[:-1:2]:
                self.dimension(condition)
            for branch in (*operands[1:-1:2], operands[-1]):
                self._sides(branch)
            return
        if tag != "binary" or body["operator"] != "subtract":
            self.dimension(node)
            return
        left, right = self.dimension(body["lhs"]), self.dimension(body["rhs"])
        if differ((left, right)):
            words = [self._words(body["lhs"], "the left side"), self._words(body["rhs"], "the right side")]
            self._refuse(f"the units of the equation differ: {words[0]} has {left}, {words[1]} has {right}")

    def _words(self, node: int, otherwise: str) -> str:
        tag, body = self.arena.node(node)
        if tag != "coordinate" or body == "time":
            return otherwise
        kind, identity = next(iter(body.items()))
        if kind == "derivative":
            return f"der({self.arena.variables[identity]['name']})"
        return str(self.arena.variables[identity]["name"]) if kind in _VARIABLES else otherwise

    def _go_to(self, provenance: Mapping[str, Any]) -> None:
        self.place, self.tolerates = self.arena.where(provenance), self.arena.package(provenance) == STANDARD

    def _refuse(self, what: str) -> None:
        if self.tolerates:
            self.tolerated = list(dict.fromkeys([*self.tolerated, self.place]))
            return
        raise ModelicaError(f"{self.place}: {what}" if self.place else what)

    def dimension(self, node: int) -> Known:
        """Return the dimension of an expression; arrays of different quantities have none."""
        if node not in self.known:
            tag, body = self.arena.node(node)
            method = getattr(self, f"_{tag}", None)
            self.known[node] = UNKNOWN if method is None else method(node, body)
        return self.known[node]

    def _operands(self, node: int) -> list[Known]:
        return [self.dimension(operand) for operand in self.arena.operands(node)]

    def _alike(self, found: list[Known], what: str) -> Known:
        if differ(found):
            shown = dict.fromkeys(str(d) for d in found if isinstance(d, Dimension))
            self._refuse(f"{what} have different units: {' and '.join(shown)}")
        return common(found)

    # One method for each kind of node that says something about units, named after the node's tag.

    def _literal(self, node: int, body: Mapping[str, Any]) -> Known:
        value = next(iter(body.values()))
        return of_number(value) if isinstance(value, int | float) and abs(value) <= self.units_from else UNKNOWN

    def _coordinate(self, node: int, body: Any) -> Known:
        if body == "time":
            return UNKNOWN
        kind, identity = next(iter(body.items()))
        if kind == "binder":
            return PLAIN
        if kind == "derivative":
            return product(self.units[identity], SECOND, -1)
        if kind == "delay":
            return self.dimension(self.arena.storage["delays"][identity]["source"])
        return self.units[identity] if kind in _VARIABLES else UNKNOWN

    def _unary(self, node: int, body: Mapping[str, Any]) -> Known:
        return self.dimension(body["operand"])

    def _binary(self, node: int, body: Mapping[str, Any]) -> Known:
        operator = body["operator"].removeprefix("elementwise_")
        left, right = self.dimension(body["lhs"]), self.dimension(body["rhs"])
        if operator in ("multiply", "divide"):
            return product(left, right, 1 if operator == "multiply" else -1)
        if operator == "power":
            return self._power(left, right, body["rhs"])
        if operator in _ALIKE:
            found = self._alike([left, right], "the terms of a sum" if operator in _SUMS else "the compared values")
            return found if operator in _SUMS else UNKNOWN
        return UNKNOWN

    def _power(self, base: Known, exponent: Known, node: int) -> Known:
        if differ((exponent, ONE)):
            self._refuse(f"an exponent has unit {exponent}; it must have none")
        tag, body = self.arena.node(node)
        sign = 1
        if tag == "unary" and body["operator"] == "negate":
            sign, (tag, body) = -1, self.arena.node(body["operand"])
        if not isinstance(base, Dimension) or base == ONE:
            return base
        value = next(iter(body.values())) if tag == "literal" else None
        if isinstance(value, int | float):
            return base.to_the(sign * Fraction(value).limit_denominator(1000))
        return UNKNOWN

    def _conditional(self, node: int, body: Any) -> Known:
        found = self._operands(node)
        return self._alike([*found[1:-1:2], found[-1]], "the branches of an if")

    def _array(self, node: int, body: Any) -> Known:
        found = self._operands(node)
        return UNKNOWN if differ(found) else common(found)

    def _index(self, node: int, body: Mapping[str, Any]) -> Known:
        return self.dimension(body["base"])

    def _comprehension(self, node: int, body: Mapping[str, Any]) -> Known:
        return self.dimension(body["body"])

    def _range(self, node: int, body: Mapping[str, Any]) -> Known:
        return PLAIN

    def _runtime_quotient_owner(self, node: int, body: Mapping[str, Any]) -> Known:
        left, right = self.dimension(body["lhs"]), self.dimension(body["rhs"])
        found = self._alike([left, right], "the operands of a division with remainder")
        return found if body["builtin"] in ("mod", "rem") else PLAIN

    def _builtin(self, node: int, body: Mapping[str, Any]) -> Known:
        name, found = body["builtin"], self._operands(node)
        if name in _OF_NUMBERS:
            if differ([*found, ONE]):
                self._refuse(f"the argument of {name} has unit {found[0]}; it must have none, or rad")
            return PLAIN if found and found[0] == PLAIN else ONE
        if name == "sqrt":
            return found[0].to_the(Fraction(1, 2)) if isinstance(found[0], Dimension) else found[0]
        if name == "atan2":
            self._alike(found, "the arguments of atan2")
            return ONE
        if name in _SAME:
            return self._alike(found, f"the arguments of {name}")
        if name in ("smooth", "fill", "homotopy"):
            return found[1 if name == "smooth" else 0]
        if name in ("cross", "outer_product"):
            return product(found[0], found[1])
        return _CONSTANT.get(name, UNKNOWN)


_SUMS = ("add", "subtract")
_WORDS = {"binding": "value", "start": "start value", "min": "minimum", "max": "maximum"}
_VARIABLES = frozenset(("parameter", "input", "state", "algebraic", "output", "discrete_real", "discrete_value"))
_CONSTANT: dict[str, Known] = {"sign": ONE, "size": PLAIN, "ones": PLAIN, "identity": PLAIN}
