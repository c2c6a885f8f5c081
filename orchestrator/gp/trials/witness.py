"""What a diagnosis hears from the block: which functions of position and speed, each times an input, the measured trials need."""

from dataclasses import asdict
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.gp.trials.data import observation, smoothed
from orchestrator.gp.trials.functions import Verdict, needed_functions
from orchestrator.gp.trials.places import coordinates, drives
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.missing_force import missing_forces
from orchestrator.models.symbolic import SymbolicModel

# Data for each output: enough to tell functions apart, in one or two seconds.
DATA = 150


def witness_functions(model: SymbolicModel, measurements: MeasurementSet) -> tuple[Verdict, ...]:
    """Verdicts on all functions of the learning trials; none where the model shows no force that it may lack, or no input moves."""
    try:
        data = bind(measurements, model.inputs, model.outputs)
        used = model.restricted(data.output_names)
        points = coordinates(used, data.learning)
        factors = drives(used, data.learning, points)
        if not factors:
            return ()
        noise = np.array([data.noise_std[name] for name in data.output_names])
        forces = missing_forces(used, smoothed(data.learning, noise))
    except (MisfitError, ComponentError):  # a witness that has nothing to say stops no diagnosis
        return ()
    found: list[Verdict] = []
    for k, output in enumerate(forces[0].names):
        found += needed_functions(observation(k, forces, data.learning, points, factors, DATA), output)[1]
    return tuple(found)


def sentences(functions: tuple[Verdict, ...]) -> tuple[str, ...]:
    """What they say in words, one sentence for each output that lacks something."""
    found = []
    for output in dict.fromkeys(each.output for each in functions):
        needed = [each for each in functions if each.output == output and each.needed]
        if not needed:
            continue
        parts = [each.factor or "a function alone" for each in sorted(needed, key=lambda each: -each.size)]
        only = f"{parts[0]} stands out by itself" if len(parts) == 1 else f"{', '.join(parts)} count"
        found.append(
            f"what is missing at {output}, as a sum of functions of position and speed, each times an input: {only}"
        )
    return tuple(found)


def document(functions: tuple[Verdict, ...]) -> tuple[dict[str, Any], ...]:
    """For JSON: the functions that were looked at, `gain` and `price` in nats."""
    return tuple({**asdict(each), "factor": each.factor or None, "needed": bool(each.needed)} for each in functions)
