"""Start values that only motion shows: those of a model whose outputs are not its states, such as one with slow sensors."""

import numpy as np

from fmus.errors import ComponentError
from orchestrator.models.compiled import CompiledModel

# Samples of the first stretch that is followed, how much longer each next one is, and of the last.
SHORTEST, GROWTH, LONGEST = 8, 2, 128
# Steps towards the best start values of a stretch.
STEPS = 4
# How far a state may lie from its first guess, in its unit or times the guess; a stretch that shows more counts for more.
REACH = 10.0


def start_of_first_stretch(
    model: CompiledModel,
    time: np.ndarray,
    inputs: np.ndarray,
    measured: np.ndarray,
    noise: np.ndarray,
    parameters: np.ndarray,
    start: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    substeps: int,
) -> np.ndarray:
    """Return start values (nx,) from which a run follows the first stretch of a record, as far as it shows them.

    Gauss-Newton steps over stretches of growing length: a short one is nearly linear in the start values, wherever they
    are looked for from, and a longer one shows more of them. What a stretch does not show stays as it is (Tikhonov).

    Args:
        measured: (n, ny) outputs, `noise` (ny,) their standard deviations.
        start: (nx,) first guess, within `low` and `high` (nx,), which may be infinite.
        substeps: integration steps in a sample interval.
    """
    found, count = np.clip(start, low, high), SHORTEST
    guess = REACH * np.maximum(np.abs(start), 1.0)
    while count <= LONGEST:
        part = slice(0, count)
        for _ in range(STEPS):
            try:
                run = model.run(time[part], inputs[part], parameters, found, substeps=substeps, sensitivities=True)
            except ComponentError:
                return found
            assert run.sensitivities is not None
            slopes = run.sensitivities[:, :, : len(found)] / noise[None, :, None]
            left = (measured[part] - run.outputs) / noise
            columns = np.vstack([slopes.reshape(-1, len(found)), np.diag(1.0 / guess)])
            wanted = np.concatenate([left.ravel(), (start - found) / guess])
            with np.errstate(over="ignore"):  # slopes of a run that explodes
                length = np.linalg.norm(columns, axis=0)
            if not (np.all(np.isfinite(length)) and np.all(np.isfinite(wanted))):
                return found
            change = np.linalg.lstsq(columns / length, wanted, rcond=None)[0] / length
            found = np.clip(found + change, low, high)
        if count >= len(time):
            break
        count *= GROWTH
    return found
