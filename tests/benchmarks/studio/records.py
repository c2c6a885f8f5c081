"""Long records for the views: `python records.py FOLDER TRIALS SAMPLES`."""

import sys
from pathlib import Path

import numpy as np

from orchestrator.compare.result import Comparison, SetErrors, TrialCurves
from orchestrator.studio.views.store import write

UNITS, FLOOR = {"q1": "rad", "q2": "rad"}, {"q1": 0.01, "q2": 0.01}
STEP = 0.001


def trial(place: int, samples: int) -> TrialCurves:
    """A sum of tones, noise, dry friction's residual, and one sample of 3 rad that must never be lost."""
    random = np.random.default_rng(place)
    time = STEP * np.arange(samples)
    modelled = {name: np.sin(0.3 * (k + 1) * time + place) + 0.3 * np.sin(2.1 * time) for k, name in enumerate(UNITS)}
    measured = {
        name: values + 0.05 * np.sign(np.gradient(values)) + 0.01 * random.standard_normal(samples)
        for name, values in modelled.items()
    }
    measured["q1"][samples // 3 + 1000 * place % max(1, samples // 3)] = 3.0
    return TrialCurves(f"trial_{place}.csv", "learning", time, measured, modelled, {"u1": np.abs(np.sin(0.1 * time))})


def long_comparison(trials: int, samples: int) -> Comparison:
    """A comparison that holds curves and nothing else."""
    nothing = SetErrors(dict.fromkeys(UNITS, 1.0), 1.0)
    curves = tuple(trial(k, samples) for k in range(trials))
    return Comparison("model", "data", tuple(UNITS), UNITS, FLOOR, (), nothing, None, {}, curves=curves)


if __name__ == "__main__":
    write(Path(sys.argv[1]), long_comparison(int(sys.argv[2]), int(sys.argv[3])))
