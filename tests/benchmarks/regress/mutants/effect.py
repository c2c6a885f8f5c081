"""How much a mutant differs from the original, by FMPy and plain subtraction: nothing here judges with misfit."""

import math
from pathlib import Path

import numpy as np

from tests.benchmarks.regress.mutants.cases import SOLVER_TOLERANCE
from tests.benchmarks.regress.mutants.subjects import RELATIVE, Subject


def simulated(subject: Subject, fmu: Path) -> dict[str, np.ndarray]:
    """Return the outputs of an FMU at the subject's steps, by FMPy.

    Raises:
        Exception: whatever FMPy raises when the FMU cannot be run.
    """
    import fmpy

    time, columns = subject.input_table()
    table = np.zeros(len(time), dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = time
    for name, column in columns.items():
        table[name] = column
    found = fmpy.simulate_fmu(
        str(fmu),
        validate=False,
        stop_time=subject.stop_s,
        step_size=subject.step_s,
        output_interval=subject.step_s,
        relative_tolerance=SOLVER_TOLERANCE,
        input=table,
        output=list(subject.outputs),
        fmi_type="CoSimulation",
        timeout=60.0,
    )
    return {name: found[name] for name in subject.outputs}


def effect(subject: Subject, original: dict[str, np.ndarray], mutant: dict[str, np.ndarray]) -> float:
    """Return the largest difference of any output at any sample over its tolerance; infinite where there is no number."""
    worst = 0.0
    for name, absolute in subject.outputs.items():
        expected, found = original[name], mutant[name]
        if expected.shape != found.shape or not np.isfinite(found).all():
            return math.inf
        tolerance = absolute + RELATIVE * float(np.ptp(expected))
        worst = max(worst, float(np.abs(found - expected).max()) / tolerance)
    return worst
