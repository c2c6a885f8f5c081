"""From the front end's DAE to a `SymbolicSystem`: declarations, equations, their solution, the interface."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.asserts import check_asserts
from fmus.symbolic.dae import Dae, Equation, Knowns, column
from fmus.symbolic.declarations import Declarations
from fmus.symbolic.events import Kept, RelationRecorder, check_same_variables, without_memory
from fmus.symbolic.explicit import solve_blocks
from fmus.symbolic.initialization import initialize, with_guesses
from fmus.symbolic.reduction import Reduced, reduce_index
from fmus.symbolic.refusals import refuse_lost_states, refuse_unsupported
from fmus.symbolic.solution import Solution, Unknown
from fmus.symbolic.structure import check_divisors, listed, starts_of
from fmus.symbolic.system import Relations, SymbolicSystem, Variable
from fmus.symbolic.values import Value, element_names, scalars
from fmus.symbolic.verify import TranslationError, verify, verify_relations

REFINEMENTS = 2


def build_system(dae: Mapping[str, Any], name: str, description: str = "") -> SymbolicSystem:
    """Translate the flat DAE of one model into explicit symbolic functions.

    Relations in `if` expressions are evaluated as they stand, without events; `relations` has the events.

    Args:
        dae: the flat model, as the compiler gives it.
        name: name of the model.
        description: what it is, in a line.

    Raises:
        ModelicaError: for a construct outside the supported subset, named with its place.
    """
    arena = Arena(dae)
    refuse_unsupported(arena)
    # Long chains of gears magnify rounding; what is no fault of the translation disappears by refinement. Equations of ideal diodes
    # and of clutches that stick have several solutions, or none, until their relations take sides one after the other.
    failures = []
    for ways in ({}, {"refinements": REFINEMENTS}, {"by_events": True}):
        try:
            return _built(arena, dae, name, description, **ways)
        except TranslationError as error:
            failures.append(error)
    raise failures[0]


def _built(
    arena: Arena, dae: Mapping[str, Any], name: str, description: str, refinements: int = 0, by_events: bool = False
) -> SymbolicSystem:
    builder = SystemBuilder(arena, dae, name, description, refinements=refinements, by_events=by_events)
    system = builder.build()
    if not builder.recorder.found and not builder.declared.memory:
        if by_events:
            raise TranslationError(f"{name} has no relations that could take sides")
        return system
    frozen = SystemBuilder(arena, dae, name, description, freeze=True, refinements=refinements, by_events=by_events)
    relations = frozen.relations(system)
    if by_events and relations is not None:
        relations = replace(relations, memory=relations.memory or without_memory(relations.rhs))
        system = replace(system, relations=relations)
        return replace(system, notes=(*system.notes, *frozen.verified(system)))
    system = replace(system, relations=relations)
    verify_relations(system)
    return system


class SystemBuilder:
    """Collects what `build` needs from the front end's representation; used once."""

    def __init__(
        self,
        arena: Arena,
        source: Mapping[str, Any],
        name: str,
        description: str,
        *,
        freeze: bool = False,
        keeps: bool | None = None,
        refinements: int = 0,
        by_events: bool = False,
    ) -> None:
        self.refinements, self.by_events = refinements, by_events
        self.arena, self.source, self.name, self.description = arena, source, name, description
        self.declared = Declarations(arena, name, keeps=freeze if keeps is None else keeps)
        self.evaluator = self.declared.evaluator
        memory = self.declared.memory
        self.recorder = RelationRecorder(arena, self.declared.parameters, freeze, memory.symbols)

    def build(self) -> SymbolicSystem:
        declared, dae = self.declared, self._dae()
        knowns = dae.knowns
        inputs, delayed, parameters = self._defaults(knowns)
        reduced = reduce_index(dae, self._values(dae, inputs, parameters))
        refuse_lost_states(reduced)
        self._record_states(reduced)
        arguments, wanted, solution = self._solved(reduced, knowns)
        initial = ca.Function("initial", [knowns.parameters], [column([q.guess for q in reduced.states])])
        proposed = np.array(initial(parameters)).ravel().tolist()
        check_divisors(solution, arguments, [[0.0], proposed, inputs, delayed, parameters])
        history = self._history(solution, knowns)
        sources = history(knowns.time, knowns.inputs, knowns.parameters)[0]
        start = initialize(dae, reduced, sources, [[0.0], inputs, parameters, proposed])
        demoted = {q.name for q in reduced.demoted}
        others = [q for q in reduced.algebraics if q.fixed and q.name not in demoted]
        if declared.asks_initial and (dae.initial or others):
            raise ModelicaError(
                f"{self.name}: initial() in an equation together with initial equations is not supported; give start values"
            )
        system = SymbolicSystem(
            name=self.name,
            description=self.description,
            inputs=declared.variables(declared.inputs),
            states=declared.variables([q.symbol for q in reduced.states]),
            algebraics=declared.variables([q.symbol for q in reduced.algebraics]),
            parameters=declared.variables(declared.parameters),
            dependents=tuple(declared.records[name] for name in declared.dependent_names),
            outputs=tuple(self._outputs()),
            settings=declared.settings,
            rhs=solution.function("rhs", arguments, wanted),
            history=history,
            dependent=ca.Function("dependent", [knowns.parameters], [column(declared.dependents)]),
            initial=initial,
            solved=tuple(tuple(u.name() for u in ca.vertsplit(stage.symbols)) for stage in solution.stages),
            consistent=start.consistent,
            notes=(*self._choices(reduced), *start.notes, *self._asserts(parameters), *self._units()),
        )
        self.check = solution.function("rates", arguments, [self._rates(dae)])
        starts = np.array(system.start_of_states(ca.DM(parameters))).ravel()
        with_start = (replace(v, start=float(s)) for v, s in zip(system.states, starts, strict=True))
        system = replace(system, states=tuple(with_start))
        unchecked = () if self.by_events else self.verified(system)
        return replace(system, notes=(*system.notes, *unchecked))

    def verified(self, system: SymbolicSystem) -> tuple[str, ...]:
        """Compare the system with the flat equations; notes on what was not checked.

        Raises:
            TranslationError: naming an equation that does not hold.
        """
        memory = self.declared.memory.values(column(self.declared.parameters))
        return verify(system, self.check, self.rate_names, self.source, self.written, memory)

    def _rates(self, dae: Dae) -> ca.SX:
        rates = [q.derivative for q in dae.quantities if q.derivative is not None]
        self.rate_names = [symbol.name() for symbol in rates]
        return column(rates)

    def _units(self) -> tuple[str, ...]:
        found = self.source.get("unit_places") or []
        own = [note for note in found if note.endswith("has a unit")]
        places = [place for place in found if place not in own]
        return (*own, *([f"the Standard Library writes constants without units: {listed(places)}"] if places else []))

    def _asserts(self, parameters: list[float]) -> tuple[str, ...]:
        return check_asserts(self.arena, self.evaluator, self.declared.parameters, parameters)

    def _solved(
        self, reduced: Reduced, knowns: Knowns, sides: Sequence[ca.SX] = ()
    ) -> tuple[list[ca.SX], list[ca.SX], Solution]:
        """Arguments t, x, u, d, p; the derivatives of the states and the algebraic variables; what they follow from."""
        x, z = column([q.symbol for q in reduced.states]), column([q.symbol for q in reduced.algebraics])
        dx = column([q.derivative for q in reduced.states if q.derivative is not None])
        own = {s.element_hash() for s in ca.symvar(x)}
        rates = [s for s in ca.vertsplit(dx) if s.element_hash() not in own]
        unknowns = [Unknown(symbol, ca.SX(0)) for symbol in [*rates, *reduced.hidden]]
        unknowns += [Unknown(q.symbol, q.guess, q.nominal) for q in reduced.algebraics]
        arguments = [knowns.time, x, knowns.inputs, knowns.delays, knowns.parameters]
        known = ca.vertcat(*arguments, *sides)
        return arguments, [dx, z], solve_blocks(reduced.equations, unknowns, known, refinements=self.refinements)

    def relations(self, system: SymbolicSystem) -> Relations | None:
        """The model with relations that keep their side, for the variables of `system`."""
        dae = self._dae()
        inputs, _, parameters = self._defaults(dae.knowns)
        memory = self.declared.memory
        sides = [*self.recorder.sides, *memory.symbols]
        values = self._values(dae, inputs, parameters) | {side.element_hash(): 0.0 for side in sides}
        reduced = reduce_index(dae, values)
        variables = [q.name for q in (*reduced.states, *reduced.algebraics)]
        check_same_variables(variables, [v.name for v in (*system.states, *system.algebraics)], self.name)
        arguments, wanted, solution = self._solved(reduced, dae.knowns, sides)
        if not sides:
            return None
        states = [q.symbol for q in reduced.states]
        after = memory.resets(states)
        moves = any(new.element_hash() != old.element_hash() for new, old in zip(after, states, strict=True))
        kept = Kept(memory.symbols, memory.start, self.updates, memory.due, after, moves)
        self.check = self.recorder.relations(solution, arguments, [self._rates(dae)], kept).rhs
        return self.recorder.relations(solution, arguments, wanted, kept)

    def _values(self, dae: Dae, inputs: list[float], parameters: list[float]) -> dict[int, float]:
        """Numbers for the model's symbols at the start, by their hashes."""
        symbols = [*self.declared.inputs, *self.declared.parameters]
        values = dict(zip([s.element_hash() for s in symbols], [*inputs, *parameters], strict=True))
        guesses = ca.Function("guesses", [dae.knowns.parameters], [column([q.guess for q in dae.quantities])])
        numbers = np.array(guesses(parameters)).ravel()
        return values | {q.symbol.element_hash(): float(v) for q, v in zip(dae.quantities, numbers, strict=True)}

    def _record_states(self, reduced: Reduced) -> None:
        """Give derivatives that became states a record."""
        for quantity in reduced.states:
            self.declared.records.setdefault(quantity.name, Variable(quantity.name))

    @staticmethod
    def _choices(reduced: Reduced) -> tuple[str, ...]:
        names = [q.name for q in reduced.demoted]
        if not names:
            return ()
        return (
            f"rigidly coupled, so no states: {listed(names)}; states are {listed([q.name for q in reduced.states])}",
        )

    def _dae(self) -> Dae:
        self.evaluator.relations = self.recorder
        equations = self._equations("continuous_equation_operations")
        self.updates = self.declared.memory.updates(self.recorder)
        self.evaluator.relations = None
        initial = self._equations("initialization_equation_operations")
        declared, self.written = self.declared, len(equations)
        delays = column([s for value in declared.delays.values() for s in scalars(value)])
        knowns = Knowns(declared.time, column(declared.inputs), delays, column(declared.parameters))
        return Dae(knowns, with_guesses(declared.quantities), [*equations, *declared.equations], initial)

    def _equations(self, section: str) -> list[Equation]:
        found: list[Equation] = []
        for operation in self.arena.storage[section]:
            kind, body = next(iter(operation.items()))
            place = self.arena.where(body["provenance"])
            try:
                found.extend(Equation(ca.SX(item), place) for item in self._residuals(kind, body))
            except ModelicaError as error:
                raise ModelicaError(f"{place}: {error}" if place else str(error)) from error
        return found

    def _residuals(self, kind: str, body: Mapping[str, Any]) -> list[Value]:
        if kind == "residual":
            return scalars(self.evaluator.value(body["residual"]))
        view = body["scalar_view"]
        if view == "RowMajorProjection":
            return [s for node in body["bodies"] for s in scalars(self.evaluator.value(node))]
        depth = None if view == "BinderSubstitution" else view["BinderPrefixProjection"]["binder_count"]
        found: list[Value] = []
        for _ in self.evaluator.points(body["domain"], depth):
            for node in body["bodies"]:
                found.extend(scalars(self.evaluator.value(node)))
        return found

    def _history(self, solution: Solution, knowns: Knowns) -> ca.Function:
        """What each delay operator remembers, in terms of inputs and parameters, and its delay time."""
        sources: list[ca.SX] = []
        times: list[ca.SX] = []
        for index in self.declared.delays:
            entry = self.arena.storage["delays"][index]
            kind = next(iter(entry["kind"].values()))
            node = kind["delay_time"]
            time = self.evaluator.value(node["expression"] if isinstance(node, dict) else node)
            for source in scalars(self.evaluator.value(entry["source"])):
                [known] = solution.express([ca.SX(source)])
                self._check_source(known, knowns, entry)
                sources.append(known)
                times.append(ca.SX(time))
        arguments = [knowns.time, knowns.inputs, knowns.parameters]
        return ca.Function("history", arguments, [column(sources), column(times)])

    def _check_source(self, source: ca.SX, knowns: Knowns, entry: Mapping[str, Any]) -> None:
        allowed = {s.element_hash() for s in ca.symvar(ca.vertcat(knowns.time, knowns.inputs, knowns.parameters))}
        others = [s.name() for s in ca.symvar(source) if s.element_hash() not in allowed]
        if others:
            place = self.arena.where(entry["provenance"])
            raise ModelicaError(
                f"{place}: delay() of a quantity that depends on states or on another delay ({others[0]}) is not "
                "supported; delay an input, or write lags in a row, n equations such as T/n*der(z[k]) = z[k-1] - z[k]"
            )

    def _defaults(self, knowns: Knowns) -> list[list[float]]:
        """Start values of inputs, zeros for what is delayed, values of parameters."""
        declared = self.declared
        inputs, parameters = (starts_of(declared.variables(s)) for s in (declared.inputs, declared.parameters))
        return [inputs, [0.0] * knowns.delays.numel(), parameters]

    def _outputs(self) -> Iterator[str]:
        for variable in self.arena.variables:
            declared = variable["attributes"]["declared_causality"] == "output"
            if declared and "." not in variable["name"]:
                shape = tuple(self.arena.value_type(variable["value_type"])["dimensions"])
                yield from element_names(variable["name"], shape)
