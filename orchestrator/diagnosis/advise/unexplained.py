"""What no effect of the library explains, as series along the learning trials: a residual, and what it may depend on."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.blackbox.forces import missing_forces as forces_of_fmu
from orchestrator.compare.maps import Coordinate, coordinates_of, error_maps, sentence
from orchestrator.compare.where import map_rows
from orchestrator.diagnosis.advise.latent import Series, latent_force
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.models.correction import PREFIX
from orchestrator.models.missing_force import knows_its_forces, missing_forces
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.latent_force import LatentForce


def unexplained_forces(nominal: SymbolicModel, best: Refit | None, learning: LearningData) -> tuple[LatentForce, ...]:
    """The latent force of each signal, the best explained first, with the best effects found in the model.

    Coordinates are positions, speeds, inputs, time, and states that are not measured (an activation, say). A model without
    a residual in its equations, such as an FMU, gives what the signal itself is off by in free runs.

    Args:
        nominal: the model as given, with the signals that are measured.
        best: the best set, fitted; None for none.
        learning: the trials to look along.

    Returns:
        Forces in the unit of each balance; none if the residual cannot be simulated.
    """
    model, values = (nominal, np.zeros(0)) if best is None else (best.effects.model, best.values)
    try:
        residuals, hidden = _residuals(model, values, learning.trials, best)
    except MisfitError:
        return ()
    coordinates = [*_coordinates(model, learning.trials), *hidden]
    found = [curve for curve in (latent_force(series, coordinates) for series in residuals) if curve is not None]
    return tuple(sorted(found, key=lambda curve: -curve.explained[1]))


def where_forces_lack(nominal: SymbolicModel, learning: LearningData) -> tuple[list[dict[str, Any]], tuple[str, ...]]:
    """Maps of the correction residual of the model as given over everything recorded, and a sentence for each signal.

    The residual is the force that is missing at each instant, so its maps show where an effect acts, which free runs blur.
    An FMU whose states are measured and that has force inputs is asked for its rates; of others there is nothing to map.
    """
    trials = learning.trials
    try:
        if nominal.residual is None:
            residuals = [_series(*part) for part in forces_of_fmu(nominal, trials)]
            hidden = list[Series]()
        else:
            residuals, hidden = _residuals(nominal, np.zeros(0), trials, None)
    except MisfitError:
        return [], ()
    coordinates = _recorded(nominal, trials)
    coordinates += [Coordinate(series.name, series.unit, series.values) for series in hidden]
    rows: list[dict[str, Any]] = []
    sentences = []
    for residual in residuals:
        maps = [m for m in error_maps(residual.values, coordinates, _step(trials)) if m is not None]
        rows += [{**row, "force_unit": residual.unit} for row in map_rows(maps, residual.name)]
        if maps:
            sentences.append(f"missing force on {sentence(residual.name, maps)}")
    return rows, tuple(sentences)


def with_law(
    rows: Sequence[Mapping[str, Any]], nominal: SymbolicModel, best: Refit | None, learning: LearningData
) -> tuple[Mapping[str, Any], ...]:
    """The rows of `where_forces_lack` with the mean force that a fitted set of effects supplies in each bin (`law`).

    It is the force that is missing without the effects less the one that is missing with them. FMUs are left as they are.

    Args:
        rows: the maps, a row for each bin.
        nominal: the model as given, with the signals that are measured.
        best: the set that was named, fitted; None leaves the rows as they are.
        learning: the trials that the maps were drawn from.
    """
    if best is None or nominal.residual is None:
        return tuple(rows)
    try:
        left, _ = _residuals(best.effects.model, best.values, learning.trials, best)
    except MisfitError:
        return tuple(rows)
    coordinates = _recorded(nominal, learning.trials)
    after: dict[tuple[str, str, float], float] = {}
    for residual in left:
        maps = [m for m in error_maps(residual.values, coordinates, _step(learning.trials)) if m is not None]
        after |= {_bin(row): float(row["bias"]) for row in map_rows(maps, residual.name)}
    return tuple(
        {**row, "law": float(row["bias"]) - after[_bin(row)]} if math.isfinite(after.get(_bin(row), math.nan)) else row
        for row in rows
    )


def _bin(row: Mapping[str, Any]) -> tuple[str, str, float]:
    return str(row["signal"]), str(row["against"]), float(row["from"])


def _step(trials: Sequence[SmoothedTrial]) -> float:
    """Time between thinned samples (s)."""
    return float(trials[0].smoother.step * trials[0].smoother.stride)


def _recorded(nominal: SymbolicModel, trials: Sequence[SmoothedTrial]) -> list[Coordinate]:
    """What force maps are drawn over: all that was recorded."""
    times = [t.smoother.thin(t.time) for t in trials]
    units = {v.name: v.unit for v in (*nominal.inputs, *nominal.outputs)}
    signals = {name: [t.smoother.thin(t.values)[:, m] for t in trials] for m, name in enumerate(nominal.signals)}
    inputs = {
        v.name: [t.smoother.thin(t.inputs)[:, i] for t in trials]
        for i, v in enumerate(nominal.inputs)
        if any(np.ptp(t.inputs[:, i]) > 0 for t in trials)
    }
    return coordinates_of(signals, units, inputs, units, times)


def _residuals(
    model: SymbolicModel, values: np.ndarray, trials: Sequence[SmoothedTrial], best: Refit | None
) -> tuple[list[Series], list[Series]]:
    """Residual of each signal in the unit of its correction, and the states simulated along the measurements."""
    parameters = model.compiled.with_values(values)
    units = {v.name: v.unit for v in (*model.inputs, *model.outputs)}
    if model.residual is None:
        runs = [_free_residual(model, parameters, trial, k, best) for k, trial in enumerate(trials)]
        return [_series(name, units.get(name, ""), [r[:, m] for r in runs]) for m, name in enumerate(model.signals)], []
    hidden = [v.name for v in model.residual.system.states]
    along = [
        [trial.smoother.thin(part) for part in parts]
        for trial, parts in zip(trials, _along(model, parameters, trials, hidden), strict=True)
    ]
    residuals = [
        _series(name, units.get(PREFIX + name, ""), [force[:, m] for force, _ in along])
        for m, name in enumerate(model.signals)
    ]
    return residuals, [_series(name, "", [path[:, j] for _, path in along]) for j, name in enumerate(hidden)]


def _along(
    model: SymbolicModel, parameters: np.ndarray, trials: Sequence[SmoothedTrial], hidden: Sequence[str]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Missing forces (n, ny) and hidden states (n, h) along each trial, by a smoother; by second differences where that
    cannot be."""
    names = [v.name for v in model.system.states]
    places = [names.index(name) for name in hidden]
    if knows_its_forces(model):
        with suppress(MisfitError):  # a smoother that breaks down leaves the differences
            return [(force.mean, force.states[:, places]) for force in missing_forces(model, trials, parameters)]
    assert model.residual is not None
    found = []
    for trial in trials:
        start, inputs = model.record(trial, parameters).start[places], model.residual_inputs(trial)
        force = model.compiled_residual.run(trial.time, inputs, parameters, start).outputs
        states = (
            model.hidden.run(trial.time, inputs, parameters, start).outputs if hidden else np.zeros((len(force), 0))
        )
        found.append((force, states))
    return found


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
