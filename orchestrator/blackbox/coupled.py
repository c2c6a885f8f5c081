"""An FMU with effects around it: the effects' equations joined into the two functions that the runner calls."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.library import FORCE_SLOTS, INPUT_SLOTS, OUTPUT_SLOTS, PARAMETER_SLOT, Law, Scales
from orchestrator.blackbox.sites import Sites


@dataclass(frozen=True)
class Mounted:
    """A law in a slot, at some of the slot's sites (numbers from 1)."""

    law: Law
    slot: str
    places: tuple[int, ...]


@dataclass(frozen=True)
class CoupledSystem(SymbolicSystem):
    """An FMU with effects, as far as a fit needs to know it.

    States are those of the FMU whose start can be chosen, then those of the effects; parameters are those of the
    effects. `late` pairs an output with the parameter by which its reading comes late. `rhs` is `inner`: (t, xe, u, s, d, p) -> v gives the FMU's inputs; `outer`: (t, xe, u, s, y, d, p) -> (dxe,
    z) the rates of the effects' states and the outputs. `delayed` pairs an input with the parameter that delays it.
    `follows` tells for each effect state what it follows, so where it starts: ("input", i), ("output", k) or None.
    `values` are values of the FMU's parameters that differ from its own, by value reference; `wrong` tells of others the reference,
    the FMU's own value, and the parameter that is its error as a share. Behind the inputs, `rhs`
    may give what is added to the rates of the FMU's states.
    """

    outer: ca.Function | None = None
    delayed: tuple[tuple[int, int], ...] = ()
    late: tuple[tuple[int, int], ...] = ()
    follows: tuple[tuple[str, int] | None, ...] = ()
    mounted: tuple[Mounted, ...] = field(default=())
    values: Mapping[int, float] = field(default_factory=dict)
    wrong: tuple[tuple[int, float, int], ...] = ()


def couple(name: str, sites: Sites, mounted: Sequence[Mounted]) -> CoupledSystem:
    """Join laws with an FMU; parameters are named `slot.name`, with `[k]` for those of one site each.

    Args:
        name: name of the coupled system.
        sites: where the FMU lets laws act.
        mounted: the laws, each with its slot and site.
    """
    return _Coupling(name, sites, mounted).build()


class _Coupling:
    def __init__(self, name: str, sites: Sites, mounted: Sequence[Mounted]) -> None:
        self.name, self.sites, self.mounted = name, sites, tuple(mounted)
        self.t = ca.SX.sym("t")
        self.u, self.s = ca.SX.sym("u", len(sites.inputs)), ca.SX.sym("s", sites.n_sensed)
        self.y = ca.SX.sym("y", len(sites.outputs))
        self.parameters: list[Variable] = []
        self.p: list[ca.SX] = []
        self.states: list[Variable] = []
        self.xe: list[ca.SX] = []
        self.rates: list[ca.SX] = []
        self.follows: list[tuple[str, int] | None] = []
        self.delayed: list[tuple[int, int]] = []
        self.late: list[tuple[int, int]] = []
        self.d: list[ca.SX] = []
        self.wrong: list[tuple[int, float, int]] = []

    def build(self) -> CoupledSystem:
        v = [self.u[i] for i in range(len(self.sites.inputs))]
        z = [self.y[i] for i in range(len(self.sites.outputs))]
        for part in sorted(
            self.mounted, key=lambda m: (PARAMETER_SLOT, *INPUT_SLOTS, *FORCE_SLOTS, *OUTPUT_SLOTS).index(m.slot)
        ):
            for place in part.places:
                if part.slot == PARAMETER_SLOT:
                    port = self.sites.parameters[place - 1]
                    own = float(port.variable.start or 0.0)
                    self._mount(part, place, {"u": ca.SX(own)}, None, Scales({}, {}, (0.0, 1.0)))
                    self.wrong.append((port.reference, own, len(self.p) - 1))
                elif part.slot in FORCE_SLOTS:
                    force = self.sites.forces[place - 1]
                    sensed = {"q": self.s[force.position], "w": self.s[force.speed]}
                    v[force.input] += force.sign * self._mount(part, place, sensed, None, self.sites.force_scales)
                elif part.slot in INPUT_SLOTS:
                    i = self.sites.driven[place - 1]
                    scales = self.sites.input_scales[place - 1]
                    v[i] = self._mount(part, place, {"u": v[i]}, ("input", i), scales)
                else:
                    k = self.sites.measured[place - 1]
                    scales = self.sites.output_scales[place - 1]
                    z[k] = self._mount(part, place, {"u": z[k]}, ("output", k), scales)
        xe, p, d = _column(self.xe), _column(self.p), _column(self.d)
        states = (*self.sites.states, *self.states)
        initial = [0.0 if v.start is None else v.start for v in states]
        inner = [self.t, xe, self.u, self.s, d, p]
        return CoupledSystem(
            name=self.name,
            description="",
            inputs=self.sites.inputs,
            states=states,
            algebraics=self.sites.outputs,
            parameters=tuple(self.parameters),
            dependents=(),
            outputs=tuple(v.name for v in self.sites.outputs),
            rhs=ca.Function("effects_in", inner, [ca.densify(_column(v))]),
            history=ca.Function("history", [self.t, self.u, p], [_column([]), _column([])]),
            dependent=ca.Function("dependent", [p], [_column([])]),
            initial=ca.Function("initial", [p], [ca.DM(initial)]),
            settings=self._settings(),
            outer=ca.Function(
                "effects_out",
                [self.t, xe, self.u, self.s, self.y, d, p],
                [ca.densify(_column(self.rates)), ca.densify(_column(z))],
            ),
            delayed=tuple(self.delayed),
            late=tuple(self.late),
            follows=tuple(self.follows),
            wrong=tuple(self.wrong),
            mounted=self.mounted,
        )

    def _settings(self) -> dict[str, bool | float | str]:
        """Slots as the search knows them: free while nothing is mounted."""
        taken = {part.slot for part in self.mounted}
        counts = {
            **dict.fromkeys(INPUT_SLOTS, len(self.sites.driven)),
            **dict.fromkeys(FORCE_SLOTS, len(self.sites.forces)),
            **dict.fromkeys(OUTPUT_SLOTS, len(self.sites.measured)),
            PARAMETER_SLOT: len(self.sites.parameters),
        }
        return {f"{slot}.present": slot in taken for slot, count in counts.items() if count}

    def _mount(
        self, part: Mounted, place: int, inputs: dict[str, ca.SX], follows: tuple[str, int] | None, scales: Scales
    ) -> ca.SX:
        """Add a copy of a law; returns its output."""
        system = part.law.system
        values = [self._parameter(part, place, v, scales) for v in system.parameters]
        first = system.initial([0.0 if v.start is None else v.start for v in system.parameters]).full().ravel()
        x = []
        for variable, start in zip(system.states, first, strict=True):
            label = f"{part.slot}.{variable.name}[{place}]"
            x.append(ca.SX.sym(label))
            self.states.append(Variable(label, start=start, minimum=variable.minimum, maximum=variable.maximum))
            self.follows.append(follows)
        u = _column([inputs[v.name] for v in system.inputs])
        delayed = []
        if system.n_delays and follows is not None and follows[0] == "output":
            # What is shown late acts on nothing: the run is shifted when it has ended.
            self.late.append((follows[1], self._position(values[0])))
            return inputs["u"]
        if system.n_delays:
            assert follows is not None
            delayed.append(ca.SX.sym(f"{part.slot}[{place}]"))
            self.d += delayed
            self.delayed.append((follows[1], self._position(values[0])))
        dx, z = system.rhs(self.t, _column(x), u, _column(delayed), _column(values))
        named = dict(zip([v.name for v in system.states], x, strict=True))
        named |= {v.name: z[i] for i, v in enumerate(system.algebraics)}
        self.xe += x
        self.rates += [dx[i] for i in range(len(x))]
        return named[system.outputs[0]]

    def _position(self, symbol: ca.SX) -> int:
        return next(k for k, known in enumerate(self.p) if ca.is_equal(known, symbol))

    def _parameter(self, part: Mounted, place: int, variable: Variable, scales: Scales) -> ca.SX:
        """Symbol of a law's parameter, in the FMU's units; fixed ones are numbers."""
        entry = part.law.entries[variable.name]
        scale, offset = scales.factor(entry["unit"]), scales.offset(entry["unit"])
        low, high = offset + scale * entry["low"], offset + scale * entry["high"]
        if entry["low"] == entry["high"]:
            return ca.SX(low)
        label = f"{part.slot}.{variable.name}" + ("" if entry.get("shared") else f"[{place}]")
        for known, symbol in zip(self.parameters, self.p, strict=True):
            if known.name == label:
                return symbol
        start = float(np.clip(offset + scale * entry["start"], low, high))
        self.parameters.append(
            replace(variable, name=label, unit=scales.unit(entry["unit"]), start=start, minimum=low, maximum=high)
        )
        self.p.append(ca.SX.sym(label))
        return self.p[-1]


def _column(scalars: Sequence[ca.SX]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *scalars)
