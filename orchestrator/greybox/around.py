"""An FMU with a fitted set of effects around it, as it is run: forces at its states, changed inputs, outputs and parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from fmus.symbolic.system import Variable
from orchestrator.blackbox.coupled import CoupledSystem
from orchestrator.blackbox.model import CoupledModel
from orchestrator.blackbox.ports import Description
from orchestrator.blackbox.sites import Sites, plain_sites, wired
from orchestrator.blackbox.source import FmuSource
from orchestrator.greybox.expression import evaluate
from orchestrator.greybox.laws import Law
from orchestrator.greybox.places import Place, coordinate
from orchestrator.greybox.search import FittedSet


@dataclass(frozen=True)
class Placed:
    """A law at a place with values of its parameters."""

    law: Law
    place: Place
    values: Mapping[str, float]


def placed(chosen: FittedSet) -> list[Placed]:
    """The effects of a fitted set."""
    return [
        Placed(c.law, c.place, {p.name: chosen.value(c, p.name)[0] for p in c.law.parameters})
        for c in chosen.candidates
    ]


def fmu_with(
    source: FmuSource,
    effects: Sequence[Placed],
    acting: Mapping[str, str],
    states: Mapping[str, str],
    signals: Sequence[str],
) -> CoupledModel:
    """The FMU with effects, as a model that follows trials.

    Args:
        acting: by balance, the input that acts on it as a force does, empty if none does. states: by balance, its state.
    """
    description = source.fmu.started
    sites = _all_states_sensed(description, source.fmu.positions())
    system = _Around(source.name, effects, acting, states, description, sites).system()
    return CoupledModel(source.name, system, source.fmu, sites, signals, held=source.held)


def _all_states_sensed(description: Description, positions: Mapping[int, Any]) -> Sites:
    sites = plain_sites(description)
    references, count, _ = wired(description.states)
    wiring = replace(sites.wiring, sensed=references, n_sensed=count)
    return replace(sites, wiring=wiring, positions=dict(positions))


class _Around:
    """The equations between the FMU and what is given and shown."""

    def __init__(
        self,
        name: str,
        effects: Sequence[Placed],
        acting: Mapping[str, str],
        states: Mapping[str, str],
        description: Description,
        sites: Sites,
    ) -> None:
        self.name, self.effects, self.acting, self.state_of = name, tuple(effects), acting, states
        self.description, self.sites = description, sites
        self.t = ca.SX.sym("t")
        self.u, self.s = ca.SX.sym("u", len(sites.inputs)), ca.SX.sym("s", len(description.states))
        self.y = ca.SX.sym("y", len(sites.outputs))
        self.states: list[Variable] = []
        self.x: list[Any] = []
        self.rates: list[Any] = []
        self.follows: list[tuple[str, int] | None] = []

    def system(self) -> CoupledSystem:
        inputs = {v.name: self.u[k] for k, v in enumerate(self.sites.inputs)}
        outputs = {v.name: self.y[k] for k, v in enumerate(self.sites.outputs)}
        states = {p.name: self.s[k] for k, p in enumerate(self.description.states)}
        for c in self._at("input"):
            inputs[c.place.site] = self._law(c, {"u": inputs[c.place.site]})
        known = states | inputs | {"time": self.t}
        added = [ca.SX(0)] * len(states)
        for c in (*self._at("motion"), *self._at("storage")):
            value = self._law(c, {k: coordinate(text, known) for k, text in c.place.coordinates.items()})
            for name, factor in c.place.adds.items():
                self._add(name, factor * value, inputs, added)
        commands = {v.name: self.u[k] for k, v in enumerate(self.sites.inputs)}
        for c in (*self._at("output"), *self._at("response")):
            names = {"y": outputs[c.place.coordinates["y"]]}
            if "u" in c.place.coordinates:
                names["u"] = commands[c.place.coordinates["u"]]
            outputs[c.place.coordinates["y"]] = self._law(c, names)
        return self._assembled(list(inputs.values()), added, list(outputs.values()))

    def _at(self, kind: str) -> list[Placed]:
        return [each for each in self.effects if each.place.kind == kind]

    def _law(self, effect: Placed, coordinates: Mapping[str, Any]) -> Any:
        names = {"t": self.t, **coordinates, **effect.values}
        sites = {
            "u": ("input", [v.name for v in self.sites.inputs]),
            "y": ("output", [v.name for v in self.sites.outputs]),
        }
        for state in effect.law.states:
            begins = effect.law.starts.get(state, "")
            kind, known = sites.get(begins, ("", []))
            self.follows.append((kind, known.index(effect.place.coordinates[begins])) if kind else None)
            self.states.append(Variable(f"{effect.law.id} at {effect.place.site}.{state}", start=0.0))
            self.x.append(ca.SX.sym(state))
            names[state] = self.x[-1]
        self.rates += [evaluate(rate, names) for rate in effect.law.states.values()]
        return evaluate(effect.law.expression, names)

    def _add(self, name: str, value: Any, inputs: dict[str, Any], added: list[Any]) -> None:
        """Let a force act: through the input that is one, else on the rate of its state."""
        if self.acting[name]:
            inputs[self.acting[name]] = inputs[self.acting[name]] + value
        else:
            k = [p.name for p in self.description.states].index(self.state_of[name])
            added[k] = added[k] + value

    def _values(self) -> dict[int, float]:
        """Parameters of the FMU that are to be other than they are."""
        reference = {p.name: p.reference for p in self.description.parameters}
        start = {p.name: float(p.variable.start or 0.0) for p in self.description.parameters}
        found = {}
        for c in self._at("parameter"):
            names = {"p": start[c.place.site], **c.values}
            found[reference[c.place.site]] = float(evaluate(c.law.expression, names))
        return found

    def _assembled(self, inputs: list[Any], added: list[Any], outputs: list[Any]) -> CoupledSystem:
        def column(items: list[Any]) -> Any:
            return ca.densify(ca.vertcat(ca.SX(0, 1), *items))

        x, d, p = column(self.x), ca.SX.sym("d", 0), ca.SX.sym("p", 0)
        variables = (*self.sites.states, *self.states)
        forces = added if any(not ca.SX(a).is_zero() for a in added) else []
        return CoupledSystem(
            name=self.name,
            description="",
            inputs=self.sites.inputs,
            states=variables,
            algebraics=self.sites.outputs,
            parameters=(),
            dependents=(),
            outputs=tuple(v.name for v in self.sites.outputs),
            rhs=ca.Function("effects_in", [self.t, x, self.u, self.s, d, p], [column([*inputs, *forces])]),
            history=ca.Function("history", [self.t, self.u, p], [ca.SX(0, 1), ca.SX(0, 1)]),
            dependent=ca.Function("dependent", [p], [ca.SX(0, 1)]),
            initial=ca.Function("initial", [p], [ca.DM([v.start or 0.0 for v in variables])]),
            outer=ca.Function(
                "effects_out", [self.t, x, self.u, self.s, self.y, d, p], [column(self.rates), column(outputs)]
            ),
            follows=tuple(self.follows),
            values=self._values(),
        )
