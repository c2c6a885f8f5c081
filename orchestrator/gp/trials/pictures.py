"""Pictures of learned functions: the size of each over the coordinate that it changes with most."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from orchestrator.gp.fit import Fit
from orchestrator.gp.posterior import condition
from orchestrator.gp.trials.functions import Verdict
from orchestrator.gp.trials.places import SPEED

BINS = 20
Z90 = 1.645


def pictures(found: Fit, needed: Sequence[Verdict], unit: str, units: Mapping[str, str]) -> list[dict[str, Any]]:
    """Needed functions at the data, by bins of one coordinate: means with 90 % half widths, in the form of a diagnosis' `witness`.

    Args:
        needed: which functions of the fit, largest first.
        unit: of the missing force.
        units: of the coordinates, in the order of the points' columns.
    """
    posterior, (seen,) = condition(found.latents, found.observations), found.observations
    return [_picture(posterior.predict(each.function, seen.inputs), each, seen.inputs, unit, units) for each in needed]


def _picture(
    predicted: tuple[np.ndarray, np.ndarray], verdict: Verdict, points: np.ndarray, unit: str, units: Mapping[str, str]
) -> dict[str, Any]:
    mean, deviation = predicted[0][:, 0], np.sqrt(predicted[1])
    columns = [_bins(column) for column in points.T]
    told = [float(np.var([mean[b].mean() for b in bins])) for bins in columns]
    best = int(np.argmax(told))
    name = list(units)[best]
    times = f", times {verdict.factor}" if verdict.factor else ""
    return {
        "balance": f"{verdict.output}{times}",
        "unit": unit,
        "coordinate": f"speed of {name.removesuffix(SPEED)}" if name.endswith(SPEED) else name,
        "coordinate_unit": units[name],
        "x": [float(points[b, best].mean()) for b in columns[best]],
        "force": [float(mean[b].mean()) for b in columns[best]],
        "band": [float(Z90 * deviation[b].mean()) for b in columns[best]],
        "law": [],
    }


def _bins(column: np.ndarray) -> list[np.ndarray]:
    """Masks of bins with about as many data each."""
    edges = np.unique(np.quantile(column, np.linspace(0.0, 1.0, BINS + 1)))
    place = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, max(len(edges) - 2, 0))
    return [place == k for k in np.unique(place)]
