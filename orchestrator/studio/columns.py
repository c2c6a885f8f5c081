"""Which column is which model variable, as a table for people."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements import MeasurementSet, Trial
from orchestrator.measurements.matching import match_columns

if TYPE_CHECKING:
    from fmus.symbolic.system import Variable
    from orchestrator.models.contract import Model

# Points that a small picture can show.
CURVE_POINTS = 120


def column_rows(measurements: MeasurementSet, model: "Model | None") -> list[dict[str, Any]]:
    """One row for each column of the first trial, time left out: its unit, the variable it is, and what becomes of it.
    `curve` holds a few of its values, evenly over its time, for a small picture.

    Nothing is refused here, so that a column that does not fit stands in the table beside those that do.
    """
    first = measurements.trials[0]
    inputs, outputs = ((), ()) if model is None else (tuple(model.inputs), tuple(model.outputs))
    names = [variable.name for variable in (*inputs, *outputs)]
    matching = match_columns(tuple(first.columns), measurements.variables, names)
    variable_of = {column: name for name, column in matching.column_of.items()}
    known = {variable.name: variable for variable in (*inputs, *outputs)}
    roles = {v.name: "drives the model" for v in inputs} | {v.name: "compared" for v in outputs}
    return [
        _row(column, first.units.get(column, ""), known.get(variable_of.get(column, "")), roles)
        | {"interpolation": measurements.interpolation.get(column, ""), "curve": _curve(first, column)}
        for column in first.columns
    ]


def _row(column: str, unit: str, variable: "Variable | None", roles: dict[str, str]) -> dict[str, str]:
    name = "" if variable is None else variable.name
    return {
        "column": column,
        "unit": unit or "not given",
        "variable": name,
        "model_unit": "" if variable is None else variable.unit or "not given",
        "conversion": "" if variable is None else _conversion(unit, variable.unit),
        "role": roles.get(name, "kept and shown"),
    }


def _conversion(unit: str, wanted: str) -> str:
    if not unit or not wanted:
        return f"taken as {wanted or unit or 'it is'}"
    try:
        factor = conversion(unit, wanted)
    except MisfitError:
        return f"impossible: {unit} is no {wanted}"
    return "as it is" if factor == 1.0 else f"times {factor:.6g}"


def _curve(trial: Trial, column: str) -> list[float]:
    values = trial.columns[column]
    places = np.linspace(0, len(values) - 1, min(CURVE_POINTS, len(values))).astype(int)
    return [float(f"{value:.4g}") for value in values[places]]


def trial_rows(measurements: MeasurementSet) -> Sequence[dict[str, Any]]:
    """One row for each trial: name, set, samples and seconds."""
    return [
        {
            "file": trial.name,
            "set": trial.subset.replace("_", " "),
            "samples": len(trial.time),
            "seconds": float(trial.time[-1] - trial.time[0]),
        }
        for trial in measurements.trials
    ]
