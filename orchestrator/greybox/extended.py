"""A model with candidates in it: one system whose parameters are theirs, beside the balance inputs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.expression import evaluate
from orchestrator.greybox.places import coordinate

CORRECTION = "correction_"
OUTPUT = "reading({})"


@dataclass(frozen=True, eq=False)
class Extended:
    """A system with candidates; `outputs` are what is compared. `begin(t, x, u, d, p)` is what the states that candidates
    bring with them start with, at the first instant of a trial with states x of the model, and `unsure` the standard deviations
    of that."""

    system: SymbolicSystem
    outputs: tuple[str, ...]
    balances: tuple[str, ...]
    begin: ca.Function
    unsure: tuple[float, ...]


def own_inputs(system: SymbolicSystem, balances: Sequence[Balance]) -> tuple[Variable, ...]:
    """The inputs that a model with balance inputs has of its own, in the system's order."""
    forces = {b.input for b in balances}
    return tuple(v for v in system.inputs if v.name not in forces and not v.name.startswith(CORRECTION))


def extend(
    base: SymbolicSystem, balances: Sequence[Balance], signals: Sequence[str], candidates: Sequence[Candidate]
) -> Extended:
    """Put candidates into a model.

    Args:
        base: the model with balance inputs. signals: outputs that are measured.

    Returns:
        A system whose inputs are the model's own, whose parameters are the model's, the balance inputs, and those of the
        candidates, gains at 0; its outputs are readings of the signals.
    """
    return _Extension(base, balances, signals, candidates).build()


class _Extension:
    def __init__(
        self, base: SymbolicSystem, balances: Sequence[Balance], signals: Sequence[str], candidates: Sequence[Candidate]
    ) -> None:
        self.base, self.balances, self.signals, self.candidates = (
            base,
            tuple(balances),
            tuple(signals),
            tuple(candidates),
        )
        self.inputs = own_inputs(base, balances)
        symbol: Any = ca.SX.sym if base.rhs.is_a("SXFunction") else ca.MX.sym
        self.zero: Any = ca.SX if base.rhs.is_a("SXFunction") else ca.MX
        self.t = symbol("t")
        self.x = [symbol(v.name) for v in base.states]
        self.u = [symbol(v.name) for v in self.inputs]
        self.p = [symbol(v.name) for v in base.parameters]
        self.c = [symbol(b.input) for b in balances]
        self.d = symbol("d", base.n_delays)
        self.own: list[tuple[Variable, Any]] = []
        self.states: list[tuple[Variable, Any, Any]] = []
        self.starts: list[Any] = []
        self.unsure: list[float] = []
        self.symbol = symbol
        self.algebraics = [v.name for v in base.algebraics]

    def build(self) -> Extended:
        parameters = {v.name: s for v, s in zip(self.base.parameters, self.p, strict=True)}
        inputs = {v.name: s for v, s in zip(self.inputs, self.u, strict=True)}
        states = {v.name: s for v, s in zip(self.base.states, self.x, strict=True)}
        for c in self._at("parameter"):
            parameters[c.place.site] = self._law(c, {"p": parameters[c.place.site], "t": self.t})
        given = dict(inputs)
        for c in self._at("between_inputs"):
            acts = c.place.coordinates["u"]
            inputs[acts] = self._law(c, {"u": inputs[acts], "other": given[c.place.coordinates["other"]], "t": self.t})
        for c in self._at("input"):
            inputs[c.place.site] = self._law(c, {"u": inputs[c.place.site], "t": self.t})
        forces = {b.input: s for b, s in zip(self.balances, self.c, strict=True)}
        x: Any = ca.vertcat(*self.x) if self.x else self.zero(0, 1)
        p: Any = ca.vertcat(*parameters.values()) if parameters else self.zero(0, 1)
        known = states | inputs | {"time": self.t}
        if any(c.place.coordinates.get("x", "(") in self.algebraics for c in self._at("storage")):
            shown = self.base.rhs(self.t, x, self._given(inputs, forces), self.d, p)[1]
            known = {name: shown[k] for k, name in enumerate(self.algebraics)} | known
        for c in (*self._at("motion"), *self._at("storage")):
            if "net" in c.law.asks_for:
                continue
            coordinates = {k: coordinate(text, known) for k, text in c.place.coordinates.items()}
            value = self._law(c, coordinates)
            for name, factor in c.place.adds.items():
                forces[name] = forces[name] + factor * value
        column = self._given(inputs, forces)
        for c in (*self._at("motion"), *self._at("storage")):
            if "net" in c.law.asks_for and c.place.balance is not None:
                balance = c.place.balance
                rates = self.base.rhs(self.t, x, column, self.d, p)[0]
                net = c.place.storage * rates[[v.name for v in self.base.states].index(balance.state)]
                coordinates = {k: coordinate(text, known) for k, text in c.place.coordinates.items()}
                forces[balance.input] += self._law(c, coordinates | {"net": net, "storage": c.place.storage})
        column = self._given(inputs, forces)
        dx, z = self.base.rhs(self.t, x, column, self.d, p)
        values = states | {v.name: z[i] for i, v in enumerate(self.base.algebraics)}
        readings = {name: values[name] for name in self.signals}
        for c in (*self._at("output"), *self._at("response")):
            name = c.place.coordinates["y"]
            given_by = {"u": inputs[c.place.coordinates["u"]]} if "u" in c.place.coordinates else {}
            readings[name] = self._law(c, {"y": readings[name], "t": self.t} | given_by)
        return self._assembled(dx, readings, column, p)

    def _given(self, inputs: Mapping[str, Any], forces: Mapping[str, Any]) -> Any:
        values = [inputs.get(v.name, forces.get(v.name, 0.0)) for v in self.base.inputs]
        return ca.vertcat(*values) if values else self.zero(0, 1)

    def _at(self, kind: str) -> list[Candidate]:
        return [c for c in self.candidates if c.place.kind == kind]

    def _law(self, candidate: Candidate, coordinates: Mapping[str, Any]) -> Any:
        """Value of a law, whose parameters become parameters of the system, and its states states."""
        names = dict(coordinates)
        for parameter in candidate.law.parameters:
            name = candidate.symbol(parameter)
            names[parameter.name] = own = self.symbol(name)
            start = 0.0 if parameter.gain else candidate.shapes[parameter.name]
            self.own.append((Variable(name, parameter.unit(candidate.place.units), parameter.description, start), own))
        for state in candidate.law.states:
            names[state] = self.symbol(f"{candidate.label}.{state}")
        for state, rate in candidate.law.states.items():
            record = Variable(candidate.state_symbol(state), "", "", 0.0)
            self.states.append((record, names[state], evaluate(rate, names)))
            unsure = candidate.law.unknown_starts.get(state)
            # Nobody knows what something late held when a trial began: the input may have moved just before.
            late = candidate.place.range[1] if state in candidate.law.starts else 0.0
            self.unsure.append(candidate.shapes[unsure] if unsure else late)
            start = self.zero(0.0 if unsure else evaluate(candidate.law.starts.get(state, "0"), names))
            earlier = [symbol for _, symbol, _ in self.states[: len(self.starts)]]
            if earlier:  # what a law sees may hold the state of another one before it
                start = ca.substitute(start, ca.vertcat(*earlier), ca.vertcat(*self.starts))
            self.starts.append(start)
        return evaluate(candidate.law.expression, names)

    def _assembled(self, dx: Any, readings: Mapping[str, Any], given: Any, p: Any) -> Extended:
        def column(items: Sequence[Any]) -> Any:
            return ca.vertcat(*items) if items else self.zero(0, 1)

        base = self.base
        x = column([*self.x, *(s for _, s, _ in self.states)])
        rates = ca.vertcat(dx, *(rate for _, _, rate in self.states))
        every = column([*self.p, *self.c, *(s for _, s in self.own)])
        u = column(self.u)
        source, delay = base.history(self.t, given, p)
        start = base.initial(column(self.p))
        states = (*base.states, *(v for v, _, _ in self.states))
        unit = {v.name: v for v in (*base.states, *base.algebraics)}
        outputs = tuple(OUTPUT.format(name) for name in self.signals)
        algebraics = tuple(replace(unit[s], name=OUTPUT.format(s)) for s in self.signals)
        balances = tuple(b.input for b in self.balances)
        system = replace(
            base,
            inputs=self.inputs,
            states=states,
            algebraics=algebraics,
            parameters=(
                *base.parameters,
                *(Variable(name, start=0.0) for name in balances),
                *(variable for variable, _ in self.own),
            ),
            dependents=(),
            outputs=outputs,
            rhs=ca.Function("rhs", [self.t, x, u, self.d, every], [rates, column([readings[s] for s in self.signals])]),
            history=ca.Function("history", [self.t, u, every], [source, delay]),
            dependent=ca.Function("dependent", [every], [self.zero(0, 1)]),
            initial=ca.Function("initial", [every], [ca.vertcat(start, self.zero(len(self.states), 1))]),
            consistent=None,
            relations=None,
        )
        terms = column(self.starts)  # what begins at zero is not stored, so that nobody has to ask for it
        start_of_terms = ca.sparsify(terms) if isinstance(terms, ca.SX) else ca.densify(terms)
        begin = ca.Function("begin", [self.t, column(self.x), u, self.d, every], [start_of_terms])
        return Extended(system, outputs, balances, begin, tuple(self.unsure))
