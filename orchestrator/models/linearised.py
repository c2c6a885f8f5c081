"""A symbolic model linearised along a path of its states: exact slopes by CasADi at many instants at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True, eq=False)
class Along:
    """A model along a reference of states and forces (n, nx + k): slopes of the rates `flow` (n - 1, nx, nx + k) in
    them and `push` (n - 1, nx, nu) in inputs, where a step leads to, `reached` (n - 1, nx), what is `shown` (n, ny)
    there, its slopes.
    """

    reference: np.ndarray
    flow: np.ndarray
    push: np.ndarray
    reached: np.ndarray
    shown: np.ndarray
    show: np.ndarray

    def part(self, begin: int, end: int) -> "Along":
        """The same for samples from `begin` to before `end`."""
        steps, samples = slice(begin, end - 1), slice(begin, end)
        return Along(
            self.reference[samples],
            self.flow[steps],
            self.push[steps],
            self.reached[steps],
            self.shown[samples],
            self.show[samples],
        )


class Equations:
    """Rates, outputs and their exact slopes at many instants at once."""

    def __init__(self, model: SymbolicModel, parameters: np.ndarray) -> None:
        system = model.system
        self._parameters = ca.DM(parameters)
        self._held = np.array([v.name in model.compiled.held for v in system.inputs], dtype=bool)
        t, p = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
        x, u = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs))
        dx, z = system.rhs(t, x, u, ca.SX(0, 1), p)
        named = {v.name: x[i] for i, v in enumerate(system.states)}
        named |= {v.name: z[i] for i, v in enumerate(system.algebraics)}
        y = ca.vertcat(*[named[name] for name in model.signals])
        slopes = [ca.densify(ca.jacobian(value, by)) for value in (dx, y) for by in (x, u)]
        self._rates = ca.Function("rates", [t, x, u, p], [ca.densify(dx)])
        self._all = ca.Function("slopes", [t, x, u, p], [ca.densify(y), *slopes])

    def along(
        self, time: np.ndarray, states: np.ndarray, inputs: np.ndarray, forces: Sequence[int], substeps: int
    ) -> Along:
        """Linearise at states (n, nx) and inputs (n, nu), of which some are the forces."""
        n, nx = states.shape
        shown, fx, fu, hx, hu = (
            np.array(part) for part in self._all.map(n)(time[None, :], states.T, inputs.T, self._parameters)
        )
        blocks = [
            part.reshape(len(part), n, width).transpose(1, 0, 2)
            for part, width in zip((fx, fu, hx, hu), (nx, inputs.shape[1]) * 2, strict=True)
        ]
        by_states, by_inputs, show_states, show_inputs = blocks
        flow = np.concatenate([by_states, by_inputs[:, :, list(forces)]], axis=2)
        return Along(
            np.hstack([states, inputs[:, list(forces)]]),
            0.5 * (flow[1:] + flow[:-1]),
            0.5 * (by_inputs[1:] + by_inputs[:-1]),
            self._steps(time, states, inputs, substeps),
            shown.T,
            np.concatenate([show_states, show_inputs[:, :, list(forces)]], axis=2),
        )

    def _steps(self, time: np.ndarray, states: np.ndarray, inputs: np.ndarray, substeps: int) -> np.ndarray:
        """Where a Runge-Kutta step from each sample leads, with inputs linear in between or held, (n - 1, nx)."""
        rates = self._rates.map(len(time) - 1)
        size = np.diff(time)[None, :] / substeps
        change = np.where(self._held, 0.0, inputs[1:] - inputs[:-1]).T / substeps
        now, x, u = time[None, :-1], states[:-1].T, inputs[:-1].T
        for _ in range(substeps):
            a = np.array(rates(now, x, u, self._parameters))
            b = np.array(rates(now + size / 2, x + size / 2 * a, u + change / 2, self._parameters))
            c = np.array(rates(now + size / 2, x + size / 2 * b, u + change / 2, self._parameters))
            d = np.array(rates(now + size, x + size * c, u + change, self._parameters))
            x = x + size / 6 * (a + 2 * b + 2 * c + d)
            now, u = now + size, u + change
        return x.T
