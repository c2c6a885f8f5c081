"""What a force at a balance would change of the whitened innovations, for any number of forces at once.

The extended Kalman filter of a fit, linearised along its run, is a linear system from a force to the innovations:
dx(k|k-1) = Phi_k dx(k-1|k-1) + Gamma_k f_k, de_c = -h_c dx / sqrt(s_c), dx <- dx - K_c h_c dx, channel after channel. One pass
with a column for each force takes the place of compiling each formula into the model.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from orchestrator.greybox.filtering import Filtered, Trial
from orchestrator.greybox.fit import Fit
from orchestrator.greybox.places import Place, coordinate


@dataclass(frozen=True, eq=False)
class Response:
    """The linearised filter of one trial: `closed` (n, nx, nx), `drive` (n, nx), `rows` (n, ny, nx), and the coordinates."""

    closed: np.ndarray
    drive: np.ndarray
    rows: np.ndarray
    coordinates: dict[str, np.ndarray]
    time: np.ndarray

    def slopes(self, forces: np.ndarray) -> np.ndarray:
        """Whitened innovations (n, ny, m) that forces (n, m) give; row k acts from sample k-1 to k."""
        n, ny, nx = self.rows.shape
        found = np.zeros((n, ny, forces.shape[1]))
        state = np.zeros((nx, forces.shape[1]))
        for k in range(1, n):
            state = self.closed[k] @ state + self.drive[k][:, None] * forces[k]
            found[k] = self.rows[k] @ state
        return found


def responses(fit: Fit, place: Place) -> list[Response]:
    """The response of each trial to a force at a place."""
    slopes = _Slopes(fit, place)
    found = []
    for trial, noise in zip(fit.trials, fit.noise, strict=True):
        run = fit.box.run(trial, fit.theta, noise.intensity, noise.sensors, slopes=False, covariances=True)
        found.append(_response(slopes, trial, run, place))
    return found


class _Slopes:
    """Derivatives of a fit's model: of its rates in a force at a place, of its outputs in its states."""

    def __init__(self, fit: Fit, place: Place) -> None:
        system = fit.box.system
        symbol: Any = ca.SX.sym if system.rhs.is_a("SXFunction") else ca.MX.sym
        t, d = symbol("t"), symbol("d", system.n_delays)
        x, u = symbol("x", len(system.states)), symbol("u", len(system.inputs))
        p = symbol("p", len(system.parameters))
        rates, outputs = system.rhs(t, x, u, d, p)
        names = [v.name for v in system.parameters]
        push = sum(factor * ca.jacobian(rates, p)[:, names.index(name)] for name, factor in place.adds.items())
        seen = ca.jacobian(outputs, x)
        own = [v.name for v in system.states].index(place.balance.state) if place.balance else 0
        net = (place.storage or 0.0) * rates[own]
        self.function = ca.Function("slopes", [t, x, u, d, p], [ca.densify(push), ca.densify(seen), ca.densify(net)])
        self.values = fit.box.compiled.with_values([*np.zeros(len(fit.box.balances)), *fit.theta])
        self.delays, self.nx, self.ny = system.n_delays, len(system.states), len(fit.box.outputs)
        self.names = [v.name for v in system.states], [v.name for v in system.inputs]

    def at(self, time: np.ndarray, states: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rates per unit of force (n, nx), outputs per state (n, ny, nx), and what flows into the balance (n,)."""
        n = len(time)
        many = self.function.map(n)
        given = (time[None], states.T, inputs.T, np.zeros((self.delays, n)), np.tile(self.values[:, None], (1, n)))
        push, seen, net = (np.array(part) for part in many(*given))
        return push.T, seen.reshape(self.ny, n, self.nx).transpose(1, 0, 2), net.ravel()


def _response(slopes: _Slopes, trial: Trial, run: Filtered, place: Place) -> Response:
    assert run.transition is not None and run.ahead_covariance is not None
    n, nx, ny = len(trial.time), slopes.nx, slopes.ny
    middle, between = run.ahead.copy(), trial.inputs.copy()
    middle[1:] = 0.5 * (run.mean[:-1] + run.ahead[1:])
    between[1:] = 0.5 * (trial.inputs[:-1] + trial.inputs[1:])
    time = trial.time.copy()
    time[1:] = 0.5 * (trial.time[:-1] + trial.time[1:])
    push, _, net = slopes.at(time, middle, between)
    _, seen, _ = slopes.at(trial.time, run.ahead, trial.inputs)
    closed, drive, rows = np.zeros((n, nx, nx)), np.zeros((n, nx)), np.zeros((n, ny, nx))
    after = np.eye(nx)
    for k in range(n):
        if k:
            phi = run.transition[k]
            closed[k] = phi @ after
            drive[k] = 0.5 * (push[k] + phi @ push[k]) * (trial.time[k] - trial.time[k - 1])
        after, covariance = np.eye(nx), run.ahead_covariance[k]
        for c in range(ny):
            s = run.variance[k, c]
            if s <= 0:
                continue
            row = seen[k, c] @ after
            rows[k, c] = -row / np.sqrt(s)
            spread = covariance @ seen[k, c]
            gain = spread / s
            after = after - np.outer(gain, row)
            covariance = covariance - np.outer(gain, spread)
    states, inputs = slopes.names
    known = {name: middle[:, i] for i, name in enumerate(states)}
    known |= {name: between[:, i] for i, name in enumerate(inputs)} | {"time": time}
    coordinates = {key: coordinate(text, known) for key, text in place.coordinates.items()}
    if place.storage is not None:
        coordinates |= {"net": net, "storage": np.full(n, place.storage)}
    return Response(closed, drive, rows, coordinates, trial.time)
