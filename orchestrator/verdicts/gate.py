"""What no answer may do, whatever named it: make held-out trials worse."""

from dataclasses import replace

import numpy as np

from orchestrator.verdicts.result import Diagnosis

# Errors of free runs along held-out trials may rise by this share, which the scatter of noise explains.
WORSE = 0.02


def without_harm(found: Diagnosis) -> Diagnosis:
    """The diagnosis, or `unknown` with the set as the best one if that makes free runs along held-out trials worse."""
    before, after = (np.array(list(each.values())) for each in (found.held_out.rmse_before, found.held_out.rmse_after))
    floor = np.maximum(np.array([found.noise_floor[name] for name in found.held_out.rmse_before]), 1e-300)
    worse = np.sqrt(np.mean((after / floor) ** 2)) / max(float(np.sqrt(np.mean((before / floor) ** 2))), 1e-300)
    if found.verdict not in ("named", "ambiguous") or worse <= 1.0 + WORSE:
        return found
    return doubted(found, f"free runs along held-out trials become {100 * (worse - 1.0):.0f} % worse")


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
