"""What a competent engineer writes in an hour: least squares of the missing force, stepwise with BIC and cross-validation, and
refits of its best sets by multiple shooting."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError, MisfitError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.estimation import fit
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel
from tests.benchmarks.diagnosis.baselines.methods import forward_bic
from tests.benchmarks.diagnosis.baselines.regression import Regression, regression_of, unit

# Blocks of samples that are left out in turn, stretches of a trial that start afresh, sets that are refitted.
BLOCKS, STRETCHES, REFITTED = 5, 6, 3


def named_by_baselines(model: str, folder: Path) -> dict[str, list[str]]:
    """Effects that each baseline names on a case; none where no candidate can be screened."""
    problem = regression_of(model, folder)
    if not problem.groups:
        return {"stepwise BIC": [], "stepwise cross-validation": [], "multiple shooting": []}
    chosen = forward_bic(problem, 0).effects
    path = forward_path(problem, 3)
    sets = [tuple(dict.fromkeys(problem.ids[k] for k in path[:count])) for count in range(len(path) + 1)]
    validated = sets[_best_size(problem, path)]
    refitted = best_refit(model, folder, list(dict.fromkeys(sets))[: REFITTED + 1])
    return {
        "stepwise BIC": list(chosen),
        "stepwise cross-validation": list(validated),
        "multiple shooting": list(refitted),
    }


def forward_path(problem: Regression, most: int) -> list[int]:
    """Candidates in the order in which each explains the most of what the ones before it leave."""
    chosen: list[int] = []
    for _ in range(min(most, len(problem.groups))):
        left = {
            k: _left(problem.residual, np.hstack([problem.groups[j] for j in (*chosen, k)]))
            for k in range(len(problem.groups))
            if k not in chosen
        }
        chosen.append(min(left, key=left.__getitem__))
    return chosen


def _best_size(problem: Regression, path: Sequence[int]) -> int:
    """How many of a path's candidates predict left-out blocks best; a larger set must be better by a standard error."""
    rows = np.array_split(np.arange(len(problem.residual)), BLOCKS)
    errors = np.empty((len(path) + 1, BLOCKS))
    for count in range(len(path) + 1):
        columns = np.hstack([np.zeros((len(problem.residual), 1)), *(problem.groups[k] for k in path[:count])])
        for b, block in enumerate(rows):
            kept = np.setdiff1d(np.arange(len(problem.residual)), block)
            found, *_ = np.linalg.lstsq(unit(columns)[kept], problem.residual[kept], rcond=1e-8)
            errors[count, b] = np.mean((problem.residual[block] - unit(columns)[block] @ found) ** 2)
    best = 0
    for count in range(1, len(path) + 1):
        gain = errors[best] - errors[count]
        if gain.mean() > gain.std(ddof=1) / np.sqrt(BLOCKS):
            best = count
    return best


def _left(residual: np.ndarray, columns: np.ndarray) -> float:
    found, *_ = np.linalg.lstsq(unit(columns), residual, rcond=1e-8)
    return float(np.sum((residual - unit(columns) @ found) ** 2))


def best_refit(model: str, folder: Path, sets: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """The set of effects with the least BIC once it is fitted to stretches of the trials that each start afresh."""
    source = find_modelica_model(model)
    system = source.compile()
    data = bind(load_measurements(folder), system.inputs, SymbolicModel(source.name, system).outputs)
    noise = np.array([data.noise_std[name] for name in data.output_names])
    trials = [
        SmoothedTrial(trial.time[rows], trial.inputs[rows], trial.outputs[rows], noise)
        for trial in data.learning
        for rows in np.array_split(np.arange(len(trial.time)), STRETCHES)
    ]
    candidates = find_candidates(source, system, effect_library())[0]
    best, least = (), np.inf
    for ids in sets:
        with suppress(ComponentError, MisfitError):
            effects = EffectSet(source, [c for c in candidates if c.card.id in ids], data.output_names)
            low, high = effects.bounds()
            records = [effects.model.record(trial) for trial in trials]
            first = np.clip(effects.first_guess(), low, high)
            found = fit(effects.model.compiled, records, noise, first, low, high, substeps=2, tolerance=1e-4)
            count = sum(trial.measured.size for trial in trials)
            score = count * np.log(2 * found.cost / count) + len(first) * np.log(count)
            if score < least:
                best, least = ids, float(score)
    return best
