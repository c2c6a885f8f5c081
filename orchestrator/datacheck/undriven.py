"""Inputs of the model that no column is: a model that nothing drives is wrong, whatever physics it has."""

from collections.abc import Sequence

import numpy as np

from fmus.symbolic.system import Variable
from orchestrator.datacheck.findings import Finding
from orchestrator.measurements import BoundSet, MeasurementSet
from orchestrator.measurements.wording import listed
from orchestrator.models.correction import PREFIX


def undriven(inputs: Sequence[Variable], data: BoundSet, measurements: MeasurementSet) -> tuple[Finding, ...]:
    """Inputs that stay at 0 because no column is theirs, beside columns that change and are not used.

    A start value other than 0 is a statement on an input that was not recorded, such as an ambient temperature. The finding
    is strong where no input of the model is driven at all.
    """
    inputs = [v for v in inputs if not v.name.startswith(PREFIX)]  # a force that misfit adds is no input of a user's
    idle = [v.name for v in inputs if v.name in data.unconnected_inputs and not v.start]
    moving = [name for name in data.unused_columns if any(np.ptp(t.columns[name]) > 0 for t in measurements.trials)]
    if not idle or not moving:
        return ()
    nothing = all(v.name in data.unconnected_inputs for v in inputs)
    evidence = f"no column is {'the input' if len(idle) == 1 else 'an input of'} {listed(idle)}"
    evidence += ", so nothing drives the model" if nothing else ", which stays at 0"
    proposal = (
        f"say in [variables] of case.toml which column it is, such as {listed(moving[:3])}, which no variable is now; or repeat"
        f" misfit import with --map {moving[0]!r}={idle[0]}"
    )
    return (Finding("input", idle[0], "", evidence, proposal, strong=nothing),)
