"""Places of a model where an effect can act, with units and the scales that the record shows there."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from fmus.frontend.lint.dimensions import is_one_of
from fmus.symbolic.balances import FORCES, Balance
from fmus.symbolic.system import SymbolicSystem, Variable

# Between two stores of these anything can flow, whether the model has a way or not.
FLOWS = ("W", "Pa.m3/s", "m3/s", "kg/s", "A", "mol/s")
# What drives a flow out of a store, by the unit of the flow.
POTENTIALS = {"m3/s": "Pa", "kg/s": "Pa", "W": "K", "A": "V"}
# What drives a speed, and speeds, by dimension: a model may leave the position out.
PUSHES, SPEEDS = ("N", "N.m", "m/s2", "rad/s2"), ("m/s", "rad/s")


@dataclass(frozen=True)
class Place:
    """Where an effect can act.

    `coordinates` maps the names that laws use to expressions of the model's variables; `adds` maps balance inputs to the
    factor with which a law's value is added there. `units` and `scales` hold those of force, speed, position, state and so on;
    `range` is the centre and half width of what the position, state or input was; `storage` what a balance's equation multiplies
    the rate of its state with, None if that is no number. `others` are further variables of the model that a
    law may speak of, each with its unit and scale. `sign` is that of the model's own response on a way from an input to an output,
    `noise` the standard deviation of an input's sensor.
    """

    kind: str
    site: str
    unit: str
    coordinates: Mapping[str, str] = field(default_factory=dict)
    adds: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    range: tuple[float, float] = (0.0, 1.0)
    balance: Balance | None = None
    storage: float | None = None
    others: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    sign: float = 1.0
    noise: float = 0.0

    def widened(self, also: Mapping[str, str]) -> "Place":
        """The place with further variables of the model as coordinates; `others` has their units and scales."""
        return replace(
            self,
            coordinates={**self.coordinates, **also},
            units={**self.units, **{key: self.others[name][0] for key, name in also.items()}},
            scales={**self.scales, **{key: self.others[name][1] for key, name in also.items()}},
        )

    @property
    def is_potential(self) -> bool:
        """Whether laws of a store go with what drives flows out of it, which is another variable than what is stored."""
        stores = self.kind == "storage" and self.balance is not None
        return stores and self.balance is not None and self.coordinates["x"] != self.balance.state

    @property
    def turns(self) -> bool:
        """Whether the position is an angle that went round more than once."""
        return "rad" in self.units.get("position", "") and self.range[1] > 2 * np.pi


@dataclass(frozen=True, eq=False)
class Seen:
    """What a first filter shows of a model's variables: samples (n,) by name, over all learning trials."""

    values: Mapping[str, np.ndarray]
    forces: Mapping[str, float]


def coordinate(text: str, known: Mapping[str, Any]) -> Any:
    """The value of a coordinate: of a variable by its Modelica name, or of a sum of some with factors, `(a - 1.5*b)`."""
    if not text.startswith("("):
        return known[text]
    first, *rest = re.split(r" ([+-]) ", text[1:-1])
    total = _product(first, known)
    for sign, term in zip(rest[::2], rest[1::2], strict=True):
        value = _product(term, known)
        total = total + value if sign == "+" else total - value
    return total


def _product(term: str, known: Mapping[str, Any]) -> Any:
    factor, times, name = term.partition("*")
    return float(factor) * known[name] if times else known[term]


def _summed(factors: Mapping[str, float]) -> str:
    """A sum of variables with factors, as `coordinate` reads it."""
    (name, factor), *rest = factors.items()
    text = _term(name, factor)
    for name, factor in rest:
        text += f" {'-' if factor < 0 else '+'} {_term(name, abs(factor))}"
    return f"({text})"


def _term(name: str, factor: float) -> str:
    return name if factor == 1.0 else f"{factor:.12g}*{name}"


def _rates(system: SymbolicSystem) -> tuple[list[ca.SX], ca.SX] | None:
    """Time, states, inputs and delayed values as symbols, and the rates of the states in them with parameters as given.

    None for equations that are solved by iteration.
    """
    if not system.rhs.is_a("SXFunction"):
        return None
    sizes = {"t": 1, "x": len(system.states), "u": len(system.inputs), "d": system.n_delays}
    symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
    return symbols, system.rhs(*symbols, ca.DM([v.start or 0.0 for v in system.parameters]))[0]


def _at_samples(symbols: Sequence[ca.SX], formulas: ca.SX, system: SymbolicSystem, seen: Seen) -> np.ndarray:
    """Values (5, k) of formulas (k,) at five samples of the record."""
    n = len(seen.values["time"])
    function = ca.Function("at_samples", list(symbols), [ca.densify(formulas)])
    columns = [[seen.values.get(v.name, np.zeros(n)) for v in part] for part in (system.states, system.inputs)]
    rows = np.random.default_rng(3).integers(0, n, 5)
    values = [function(0.0, *([c[row] for c in part] for part in columns), 0.0) for row in rows]
    return np.hstack([np.array(each) for each in values]).T


def storage_of(system: SymbolicSystem, balance: Balance) -> float | None:
    """What a balance's equation multiplies the rate of its state with, if that is a number and its force moves nothing else."""
    equations = _rates(system)
    if equations is None:
        return None
    (_, _, u, _), rates = equations
    slopes = ca.simplify(ca.jacobian(rates, u[[v.name for v in system.inputs].index(balance.input)]))
    own = [v.name for v in system.states].index(balance.state)
    if not slopes.is_constant() or slopes.nnz() != 1 or not float(ca.DM(slopes)[own]):
        return None
    return 1.0 / float(ca.DM(slopes)[own])


def balance_places(system: SymbolicSystem, balances: Sequence[Balance], seen: Seen) -> list[Place]:
    """Each balance as a place, and what lies between it and another balance of its unit, or an input of its state's unit.

    Args:
        system: the equations, with an input at each balance.
        balances: the balances.
        seen: what the record shows of the variables.
    """
    units = {v.name: v.unit or "1" for v in system.states}
    found = [_with_storage(_own(balance, units, seen), system) for balance in balances]
    levers = lever_places(balances, units, seen)
    linked = linked_balances(system, balances, seen)
    for i, one in enumerate(balances):
        for j, other in enumerate(balances[i + 1 :], start=i + 1):
            stored = not one.position and not other.position and one.unit in FLOWS
            carried = any({one.input, other.input} <= place.adds.keys() for place in levers)
            if one.unit == other.unit and (stored or ((i, j) in linked and not carried)):
                found.append(_between(one, other, units, seen))
    return [*found, *levers, *driven_places(system, balances, seen)]


def lever_places(balances: Sequence[Balance], units: Mapping[str, str], seen: Seen) -> list[Place]:
    """Each force of the model that enters several balances, not merely two with opposite signs, as a place: a spring at the end
    of a beam, a torque behind a gear.

    What it moves against goes with the shares that it has in the balances (principle of virtual work): a force F that adds
    r F to a torque does the work r F dphi.

    Args:
        balances: the balances, with the forces that enter them.
        units: of the states by name.
        seen: what the record shows of the variables.
    """
    found = []
    for name in dict.fromkeys(name for b in balances for name in b.shares):
        shares = {b: -b.shares[name] for b in balances if name in b.shares and is_one_of(b.unit, FORCES)}
        one = next((b for b, share in shares.items() if abs(share) == 1.0), None)
        if one is None or len(shares) < 2 or (len(shares) == 2 and sum(shares.values()) == 0.0):
            continue
        own = {"force": one.unit, "time": "s", "speed": units[one.state]}
        force = max(seen.forces[b.input] / abs(share) for b, share in shares.items())
        scales = {"force": force, "time": _duration(seen)}
        names = {"t": "time", "v": _summed({b.state: share for b, share in shares.items()})}
        speed = coordinate(names["v"], seen.values)
        scales["speed"], centre = _rms(speed), _middle(speed)
        if all(b.position for b in shares):
            names["q"] = _summed({b.position: share for b, share in shares.items()})
            centre = _middle(coordinate(names["q"], seen.values))
            own |= {"position": units[one.position], "centre": units[one.position]}
            scales |= {"position": centre[1], "centre": 1.0}
        adds = {b.input: share for b, share in shares.items()}
        found.append(Place("motion", name, one.unit, names, adds, own, scales, centre))
    return found


def linked_balances(system: SymbolicSystem, balances: Sequence[Balance], seen: Seen) -> set[tuple[int, int]]:
    """Pairs of balances between which the model has an element already: one pushes the other, by their difference.

    The slope of one force in the other's state is the same both ways, and stays if both states move alike. Between the joints
    of a linkage forces go over, too, but not by the difference of their angles, so nothing lies between them.

    Args:
        system: the equations, with an input at each balance.
        balances: the balances.
        seen: what the record shows of the variables.

    Returns:
        Numbers of the two balances of each pair; none for equations that are solved by iteration.
    """
    equations = _rates(system)
    if equations is None or len(balances) < 2:
        return set()
    symbols, rates = equations
    x, u = symbols[1:3]
    states, inputs = ([v.name for v in part] for part in (system.states, system.inputs))
    own = ca.vertcat(*(rates[states.index(b.state)] for b in balances))
    forces = ca.solve(ca.jacobian(own, ca.vertcat(*(u[inputs.index(b.input)] for b in balances))), own)

    def by_difference(i: int, j: int, first: str, second: str) -> bool:
        k, m = states.index(first), states.index(second)
        slopes = ca.vertcat(ca.jacobian(forces[i], x[m]), ca.jacobian(forces[j], x[k]))
        shift = ca.sum2(ca.jacobian(slopes, x)[:, [k, m]])
        found = _at_samples(symbols, ca.vertcat(slopes, shift), system, seen)
        there = float(np.abs(found[:, :2]).max())
        nothing = np.column_stack([found[:, 0] - found[:, 1], found[:, 2:]])
        return there > 0 and bool(np.abs(nothing).max() <= 1e-6 * there)

    return {
        (i, j)
        for (i, one), (j, other) in combinations(enumerate(balances), 2)
        if bool(one.position) == bool(other.position)
        for ends in ((one.state, other.state), (one.position, other.position))
        if all(ends) and by_difference(i, j, *ends)
    }


def _with_storage(place: Place, system: SymbolicSystem) -> Place:
    """The place of a balance with its storage, mass or capacity, if that is a number."""
    if place.balance is None:
        return place
    return replace(place, storage=storage_of(system, place.balance))


def _own(balance: Balance, units: Mapping[str, str], seen: Seen) -> Place:
    state = balance.state
    scales = {"force": seen.forces[balance.input], "time": float(np.ptp(seen.values["time"])) or 1.0}
    own = {"force": balance.unit or "1", "time": "s"}
    if balance.position:
        q = balance.position
        centre = _middle(seen.values[q])
        scales |= {"speed": _rms(seen.values[state]), "position": centre[1], "centre": 1.0}
        own |= {"speed": units[state], "position": units[q], "centre": units[q]}
        names = {"q": q, "v": state, "t": "time"}
        return Place("motion", q, balance.unit, names, {balance.input: 1.0}, own, scales, centre, balance)
    centre = _middle(seen.values[state])
    if _is_speed(balance, units):
        scales, own = scales | {"speed": _rms(seen.values[state])}, own | {"speed": units[state]}
        names = {"v": state, "t": "time"}
        return Place("motion", state, balance.unit, names, {balance.input: 1.0}, own, scales, centre, balance)
    scales |= {"state": centre[1], "centre": 1.0}
    own |= {"state": units[state], "centre": units[state]}
    return Place(
        "storage", state, balance.unit, {"x": state, "t": "time"}, {balance.input: 1.0}, own, scales, centre, balance
    )


def _is_speed(balance: Balance, units: Mapping[str, str]) -> bool:
    """Whether a state is a speed that a force drives, although the model has no position of it."""
    return is_one_of(balance.unit, PUSHES) and is_one_of(units[balance.state], SPEEDS)


def _between(one: Balance, other: Balance, units: Mapping[str, str], seen: Seen) -> Place:
    """A parallel element from one to the other: it acts on both with opposite signs."""
    force = max(seen.forces[one.input], seen.forces[other.input])
    ends = (one.state, other.state), (one.position, other.position)
    return _across(one, *ends, {one.input: 1.0, other.input: -1.0}, force, units, seen)


def _across(
    one: Balance,
    states: tuple[str, str],
    positions: tuple[str, str],
    adds: Mapping[str, float],
    force: float,
    units: Mapping[str, str],
    seen: Seen,
) -> Place:
    """An element that acts by the difference of two states (names), or of two positions, or of both; no name, no difference."""
    own = {"force": one.unit or "1", "time": "s"}
    scales = {"force": force, "time": float(np.ptp(seen.values["time"])) or 1.0}
    moves = bool(one.position) or _is_speed(one, units)
    site, centre, names = "", (0.0, 1.0), {"t": "time"}
    for key, kind, ends in (
        ("v" if moves else "x", "speed" if moves else "state", states),
        ("q", "position", positions),
    ):
        if not all(ends):
            continue
        difference = seen.values[ends[0]] - seen.values[ends[1]]
        names[key], own[kind], site = f"({ends[0]} - {ends[1]})", units[ends[0]], f"{ends[0]}-{ends[1]}"
        centre = _middle(difference)
        scales[kind] = _rms(difference) if kind == "speed" else centre[1]
        if kind != "speed":
            scales["centre"], own["centre"] = 1.0, units[ends[0]]
    return Place("motion" if moves else "storage", site, one.unit, names, adds, own, scales, centre)


def of_states(system: SymbolicSystem) -> ca.Function | None:
    """What the model's variables that go with nothing but its states are, as a function of these by their names; None for
    equations that are solved by iteration."""
    equations = _rates(system)
    if equations is None:
        return None
    symbols = equations[0]
    _, x, u, d = symbols
    values = system.rhs(*symbols, ca.DM([v.start or 0.0 for v in system.parameters]))[1]
    own = [k for k in range(len(system.algebraics)) if not ca.depends_on(values[k], ca.vertcat(u, d))]
    return ca.Function("of_states", [x], [values[k] for k in own], ["x"], [f"z{k}" for k in own])


def along(system: SymbolicSystem, states: np.ndarray) -> dict[str, np.ndarray]:
    """Series (n,) of the variables that go with nothing but states (n, nx)."""
    function = of_states(system)
    if function is None:
        return {}
    shown = function(x=states.T)
    return {system.algebraics[int(name[1:])].name: np.array(values).ravel() for name, values in shown.items()}


def potential_places(system: SymbolicSystem, balances: Sequence[Balance], seen: Seen | None = None) -> list[Place]:
    """Each store by what drives flows out of it, where that is no multiple of what is stored: a gas by its pressure.

    A store whose potential falls while it fills, such as the gas behind a bladder, gains by a leak. Scales are 1 without a record.

    Args:
        system: the equations, with an input at each balance.
        balances: the balances.
        seen: what the record shows of the variables.
    """
    stores = [b for b in balances if b.unit in POTENTIALS and not b.position]
    function = of_states(system) if stores else None
    if function is None:
        return []
    names = [v.name for v in system.states]
    x = ca.SX.sym("x", len(names))
    start = ca.DM([v.start or 0.0 for v in system.states])
    found = []
    for balance in stores:
        for label in function.name_out():
            variable = system.algebraics[int(label[1:])]
            slopes = ca.simplify(ca.jacobian(function(x=x)[label], x))
            slope = float(ca.Function("slope", [x], [slopes[names.index(balance.state)]])(start))
            alone = slopes.nnz() == 1 and slopes.is_constant()  # laws of what is stored say the same
            if variable.unit != POTENTIALS[balance.unit] or alone or not np.isfinite(slope) or slope == 0.0:
                continue
            scales, centre = {"force": 1.0, "state": 1.0, "centre": 1.0}, (0.0, 1.0)
            if seen is not None:
                centre = _middle(along(system, np.array([seen.values[name] for name in names]).T)[variable.name])
                scales |= {"force": seen.forces[balance.input], "state": centre[1]}
            units = {"force": balance.unit, "state": variable.unit, "centre": variable.unit}
            adds, coordinates = {balance.input: float(np.sign(slope))}, {"x": variable.name}
            place = Place("storage", variable.name, balance.unit, coordinates, adds, units, scales, centre, balance)
            found.append(place)
            break
    return found


def driven_places(system: SymbolicSystem, balances: Sequence[Balance], seen: Seen) -> list[Place]:
    """An element from each balance to each input that its state or position can be compared with: a base, measured surroundings.

    From a store something can flow to any input of its unit; a force acts where the model has an element to that input already.

    Args:
        system: the equations, with an input at each balance.
        balances: the balances.
        seen: what the record shows of the variables.
    """
    units = {v.name: v.unit or "1" for v in system.states}
    forces = {b.input for b in balances}
    given = [v for v in system.inputs if v.name not in forces and np.ptp(seen.values.get(v.name, 0.0)) > 0]
    found = []
    for one in balances:
        for each in given:
            states, positions = (
                (name, each.name) if name and units[name] == (each.unit or "1") else ("", "")
                for name in (one.state, one.position)
            )
            moves = bool(one.position) or _is_speed(one, units)
            own = positions[0] or states[0]
            if own and (_pulls_to(system, each.name, own, one, seen) if moves else one.unit in FLOWS):
                force = seen.forces[one.input]
                found.append(_across(one, states, positions, {one.input: 1.0}, force, units, seen))
    return found


def _pulls_to(system: SymbolicSystem, name: str, own: str, balance: Balance, seen: Seen) -> bool:
    """Whether the model has an element from a state (`own`) to an input: the balance goes with the input as against the state."""
    equations = _rates(system)
    if equations is None:
        return False
    symbols, rates = equations
    states, inputs = ([v.name for v in part] for part in (system.states, system.inputs))
    ends = ca.vertcat(symbols[2][inputs.index(name)], symbols[1][states.index(own)])
    found = _at_samples(symbols, ca.jacobian(rates[states.index(balance.state)], ends).T, system, seen)
    return bool(np.all(found[:, 0] * found[:, 1] < 0) and np.all(np.abs(found[:, 0]) <= 1.000001 * np.abs(found[:, 1])))


def with_loads(places: Sequence[Place], inputs: Sequence[Place]) -> list[Place]:
    """Places, those at a balance that one input alone drives by its unit with this input as its load."""
    found = []
    for place in places:
        drives = [each.site for each in inputs if each.unit == place.unit]
        alone = place.balance is not None and len(drives) == 1
        found.append(replace(place, coordinates={**place.coordinates, "load": drives[0]}) if alone else place)
    return found


def crosstalk_places(inputs: Sequence[Place]) -> list[Place]:
    """Each pair of inputs of one unit, as a way from one to the other."""
    return [
        replace(place, kind="between_inputs", site=f"{other.site}->{place.site}", coordinates=names)
        for place in inputs
        for other in inputs
        if other is not place and other.unit == place.unit
        for names in [{**place.coordinates, "other": other.site}]
    ]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2))) or 1.0


def _middle(values: np.ndarray) -> tuple[float, float]:
    low, high = np.nanquantile(values, [0.002, 0.998])
    return float(0.5 * (low + high)), float(0.5 * (high - low)) or 1.0


def input_places(inputs: Sequence[Variable], seen: Seen, noise: Mapping[str, float] | None = None) -> list[Place]:
    """Each input that moves; `noise` are standard deviations of sensors by input."""
    found, noise = [], noise or {}
    for variable in inputs:
        values = seen.values[variable.name]
        if np.ptp(values) > 0:
            centre = _middle(values)
            units = {"input": variable.unit or "1", "time": "s", "centre": variable.unit or "1"}
            scales = {"input": _rms(values), "time": _duration(seen), "centre": 1.0}
            names, own = {"u": variable.name}, noise.get(variable.name, 0.0)
            found.append(
                Place("input", variable.name, variable.unit or "1", names, {}, units, scales, centre, noise=own)
            )
    return found


def output_places(outputs: Sequence[Variable], seen: Seen) -> list[Place]:
    """Each measured output."""
    found = []
    for variable in outputs:
        centre = _middle(seen.values[variable.name])
        units = {"output": variable.unit or "1", "time": "s", "centre": variable.unit or "1"}
        scales = {"output": centre[1], "time": _duration(seen), "centre": 1.0}
        site = f"sensor:{variable.name}"
        found.append(Place("output", site, variable.unit or "1", {"y": variable.name}, {}, units, scales, centre))
    return found


def response_places(
    inputs: Sequence[Variable],
    outputs: Sequence[Variable],
    seen: Seen,
    signs: Mapping[tuple[str, str], float] | None = None,
) -> list[Place]:
    """Each way from an input that moves to an output that is measured; with `signs` (by input and output) only those that the
    model has.

    Args:
        inputs: inputs of the model.
        outputs: outputs that are measured.
        seen: what the record shows of them.
        signs: sign of the model's own response by input and output, 0 for none.
    """
    found = []
    for one in input_places(inputs, seen):
        for other in output_places(outputs, seen):
            units, scales = {**one.units, **other.units}, {**one.scales, **other.scales}
            names = {**one.coordinates, **other.coordinates}
            sign = 1.0 if signs is None else signs[names["u"], names["y"]]
            if sign:
                site = f"{names['u']}->{names['y']}"
                found.append(Place("response", site, other.unit, names, {}, units, scales, sign=sign))
    return found


def _duration(seen: Seen) -> float:
    return float(np.ptp(seen.values["time"])) or 1.0


def parameter_places(system: SymbolicSystem, duration: float = 1.0) -> list[Place]:
    """Each parameter that has a value other than zero."""
    return [
        Place(
            "parameter",
            v.name,
            v.unit or "1",
            {"p": v.name},
            {},
            {"parameter": v.unit or "1", "time": "s"},
            {"parameter": abs(v.start), "time": duration},
        )
        for v in system.parameters
        if v.start
    ]


def unscaled_places(system: SymbolicSystem, balances: Sequence[Balance], inputs: Sequence[str]) -> list[Place]:
    """The places of a model without a record: scales are 1, and every two balances of one unit have something between them.

    Args:
        system: the equations, with an input at each balance.
        balances: the balances.
        inputs: names of the model's own inputs.
    """
    every = [*(v.name for v in system.states), *inputs, *system.outputs, "time"]
    seen = Seen({name: np.array([-1.0, 1.0]) for name in every}, {b.input: 1.0 for b in balances})
    units = {v.name: v.unit or "1" for v in system.states}
    found = [_with_storage(_own(balance, units, seen), system) for balance in balances]
    for i, one in enumerate(balances):
        for other in balances[i + 1 :]:
            if one.unit == other.unit and bool(one.position) == bool(other.position):
                found.append(_between(one, other, units, seen))
    found += lever_places(balances, units, seen)
    found += [*driven_places(system, balances, seen), *potential_places(system, balances)]
    variables = {v.name: v for v in (*system.states, *system.algebraics)}
    moving = [v for v in system.inputs if v.name in inputs]
    given = input_places(moving, seen)
    found = [*with_loads(found, given), *given, *crosstalk_places(given)]
    outputs = [variables[name] for name in system.outputs]
    found += [*output_places(outputs, seen), *response_places(moving, outputs, seen)]
    return with_others([*found, *parameter_places(system)], [*system.states, *moving], seen)


def with_others(places: Sequence[Place], variables: Sequence[Variable], seen: Seen) -> list[Place]:
    """Places at balances with further variables that a law there may speak of.

    Args:
        places: all places.
        variables: what laws may speak of, as far as the record shows it.
        seen: what the record shows.
    """
    others = {v.name: (v.unit or "1", _rms(seen.values[v.name])) for v in variables if v.name in seen.values}
    return [replace(p, others=others) if p.kind in ("motion", "storage") else p for p in places]
