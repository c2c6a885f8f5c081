"""What a diagnosis hears from the block: which functions of position and speed, each times an input, the measured trials need."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.gp.fit import Fit
from orchestrator.gp.posterior import condition
from orchestrator.gp.trials.data import observation, smoothed, states_and_inputs
from orchestrator.gp.trials.functions import Verdict, needed_functions
from orchestrator.gp.trials.own_effect import Share, in_words, shares
from orchestrator.gp.trials.places import SPEED, coordinates, drives
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.missing_force import missing_forces
from orchestrator.models.symbolic import SymbolicModel

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


# Data for each output: enough to tell functions apart, in one or two seconds.
DATA = 150


@dataclass(frozen=True)
class Heard:
    """Verdicts on all functions, pictures of those that are needed, largest first (see `pictures`), and which of them are a share of
    what the model lets their input do."""

    functions: tuple[Verdict, ...] = ()
    pictures: tuple[dict[str, Any], ...] = ()
    shares: tuple[Share, ...] = ()


def witness_functions(model: SymbolicModel, measurements: MeasurementSet) -> Heard:
    """What functions the learning trials need; nothing where the model shows no force that it may lack, or no input moves."""
    try:
        data = bind(measurements, model.inputs, model.outputs)
        used = model.restricted(data.output_names).with_held(data.trials[0].held)
        points = coordinates(used, data.learning)
        factors = drives(used, data.learning, points)
        if not factors:
            return Heard()
        noise = np.array([data.noise_std[name] for name in data.output_names])
        forces = missing_forces(used, smoothed(data.learning, noise))
    except (MisfitError, ComponentError):  # a witness that has nothing to say stops no diagnosis
        return Heard()
    said: list[Verdict] = []
    drawn: list[tuple[float, dict[str, Any]]] = []
    own: list[Share] = []
    at = states_and_inputs(forces, data.learning, DATA)
    units = {name: place.unit(used) for name, place in points.items()}
    for k, output in enumerate(forces[0].names):
        fitted, verdicts = needed_functions(observation(k, forces, data.learning, points, factors, DATA), output)
        needed = [each for each in verdicts if each.needed]
        said += verdicts
        own += shares(used, fitted, needed, *at)
        drawn += zip([each.size for each in needed], pictures(fitted, needed, forces[0].units[k], units), strict=True)
    largest = sorted(drawn, key=lambda pair: -pair[0])
    return Heard(tuple(said), tuple(picture for _, picture in largest), tuple(own))


def sentences(heard: Heard) -> tuple[str, ...]:
    """What they say in words, one sentence for each output that lacks something."""
    found, words = [], in_words(heard.shares)
    for output in dict.fromkeys(each.output for each in heard.functions):
        needed = [each for each in heard.functions if each.output == output and each.needed]
        if not needed:
            continue
        inputs = [each.factor for each in sorted(needed, key=lambda each: -each.size) if each.factor]
        parts = []
        if inputs:
            parts.append(f"{_joined(inputs)}, {'each ' * (len(inputs) > 1)}times a function of position and speed")
        if len(inputs) < len(needed):
            parts.append("position and speed alone")
        told = [words[output, each.factor] for each in needed if (output, each.factor) in words]
        more = f"; {', '.join(told)}" if told else ""
        found.append(f"what is missing at {output} depends on {', and on '.join(parts)}{more}")
    return tuple(found)


def _joined(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def document(heard: Heard) -> tuple[dict[str, Any], ...]:
    """For JSON: the functions that were looked at, `gain` and `price` in nats; `share` of the model's own effect where a function
    is one, and how much of it that explains."""
    own = {(each.output, each.factor): each for each in heard.shares}
    rows = []
    for each in heard.functions:
        share = own.get((each.output, each.factor))
        rows.append(
            {
                **asdict(each),
                "factor": each.factor or None,
                "needed": bool(each.needed),
                "share": None if share is None else share.share,
                "explained": None if share is None else share.explained,
            }
        )
    return tuple(rows)
