"""What no effect of the library explains, as series along the learning trials: a residual, and what it may depend on."""

from collections.abc import Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.evidence import LearningData, Refit
from orchestrator.diagnosis.latent import LatentForce, Series, latent_force
from orchestrator.models.correction import PREFIX
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel


def unexplained_forces(nominal: SymbolicModel, best: Refit | None, learning: LearningData) -> tuple[LatentForce, ...]:
    """The latent force of each signal, the best explained first, with the best effects found in the model.

    Coordinates are positions, speeds, inputs, time, and states that are not measured (an activation, say). A model without
    a residual in its equations, such as an FMU, gives what the signal itself is off by in free runs.
    """
    model, values = (nominal, np.zeros(0)) if best is None else (best.effects.model, best.fit.values)
    try:
        residuals, hidden = _residuals(model, values, learning.trials, best)
    except ComponentError:
        return ()
    coordinates = [*_coordinates(model, learning.trials), *hidden]
    found = [curve for curve in (latent_force(series, coordinates) for series in residuals) if curve is not None]
    return tuple(sorted(found, key=lambda curve: -curve.explained[1]))


def _residuals(
    model: SymbolicModel, values: np.ndarray, trials: Sequence[SmoothedTrial], best: Refit | None
) -> tuple[list[Series], list[Series]]:
    """Residual of each signal in the unit of its correction, and the states simulated along the measurements."""
    parameters = model.compiled.with_values(values)
    units = {v.name: v.unit for v in (*model.inputs, *model.outputs)}
    if model.residual is None:
        runs = [_free_residual(model, parameters, trial, k, best) for k, trial in enumerate(trials)]
        return [_series(name, units.get(name, ""), [r[:, m] for r in runs]) for m, name in enumerate(model.signals)], []
    names = [v.name for v in model.system.states]
    states = [v.name for v in model.residual.system.states]
    rows, paths = [], []
    for trial in trials:
        start = model.record(trial, parameters).start[[names.index(name) for name in states]]
        inputs = model.residual_inputs(trial)
        run = model.compiled_residual.run(trial.time, inputs, parameters, start)
        rows.append(trial.smoother.thin(run.outputs))
        if states:
            path = model.hidden.run(trial.time, inputs, parameters, start)
            paths.append(trial.smoother.thin(path.outputs))
    residuals = [
        _series(name, units.get(PREFIX + name, ""), [part[:, m] for part in rows])
        for m, name in enumerate(model.signals)
    ]
    return residuals, [_series(name, "", [path[:, j] for path in paths]) for j, name in enumerate(states)]


def _free_residual(
    model: SymbolicModel, parameters: np.ndarray, trial: SmoothedTrial, number: int, best: Refit | None
) -> np.ndarray:
    """Measured minus modelled along a trial, thinned."""
    start = model.record(trial, parameters).start if best is None else best.fit.starts[number]
    run = model.compiled.run(trial.time, trial.inputs, parameters, start)
    return trial.smoother.thin(trial.measured - run.outputs)


def _coordinates(model: SymbolicModel, trials: Sequence[SmoothedTrial]) -> list[Series]:
    """Positions, speeds, inputs and time along the trials."""
    units = {v.name: v.unit for v in (*model.inputs, *model.outputs)}
    found = []
    for m, name in enumerate(model.signals):
        found.append(_series(name, units[name], [t.smoother.thin(t.values)[:, m] for t in trials]))
        speeds = [t.smoother.thin(t.speeds)[:, m] for t in trials]
        found.append(_series(f"speed of {name}", f"{units[name] or '1'}/s", speeds))
    for i, variable in enumerate(model.inputs):
        if not variable.name.startswith(PREFIX):
            found.append(_series(variable.name, variable.unit, [t.smoother.thin(t.inputs)[:, i] for t in trials]))
    return [*found, _series("time", "s", [t.smoother.thin(t.time) for t in trials])]


def _series(name: str, unit: str, values: Sequence[np.ndarray]) -> Series:
    return Series(name, unit, tuple(np.asarray(part, dtype=float) for part in values))
