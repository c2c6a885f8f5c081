"""What no answer may do, whatever named it: make held-out trials worse, or change a model within the noise for nothing."""

from dataclasses import replace

import numpy as np

from orchestrator.compare.comparison import within_noise
from orchestrator.verdicts.result import Diagnosis

# Errors of free runs along held-out trials may change by this share, which the scatter of noise explains.
ALIKE = 0.02


def without_harm(found: Diagnosis) -> Diagnosis:
    """The diagnosis, or what is left of it without an answer that makes free runs along held-out trials no better.

    One that makes them worse is the best set of an `unknown` one. One that leaves them alike names nothing where the model as given
    stays within the noise floor along all trials: it is `adequate`.
    """
    before, after = (np.array(list(each.values())) for each in (found.held_out.rmse_before, found.held_out.rmse_after))
    floor = np.maximum(np.array([found.noise_floor[name] for name in found.held_out.rmse_before]), 1e-300)
    ratio = np.sqrt(np.mean((after / floor) ** 2)) / max(float(np.sqrt(np.mean((before / floor) ** 2))), 1e-300)
    if found.verdict not in ("named", "ambiguous") or ratio < 1.0 - ALIKE:
        return found
    if ratio > 1.0 + ALIKE:
        return doubted(found, f"free runs along held-out trials become {100 * (ratio - 1.0):.0f} % worse")
    if within_noise(found.steps[0].comparison, 1.0):
        idle = doubted(found, "the model as given stays within the noise, and held-out trials become no better")
        return replace(idle, verdict="adequate", best=())
    return found


def doubted(found: Diagnosis, reason: str) -> Diagnosis:
    """`unknown`, with what was named as the best set, and why it is not proven."""
    names = " and ".join(f"{effect.id} at {effect.site}" for effect in found.effects)
    return replace(
        found,
        verdict="unknown",
        effects=(),
        best=found.effects,
        confusable=(),
        steps=found.steps[:1],
        held_out=replace(found.held_out, rmse_after=found.held_out.rmse_before, reducible_removed=0.0),
        warnings=(
            f"the best set is {names}, not proven: {reason}" if names else f"nothing is named: {reason}",
            *found.warnings,
        ),
    )
