"""An answer of another search in the terms of the grey box: how likely it makes the record, and what it leaves unexplained."""

from dataclasses import dataclass, replace

import numpy as np

from fmus.catalogue import ModelicaModel
from orchestrator.greybox.decide import Judge, beyond_doubt
from orchestrator.greybox.evidence import case_of, nominal_set
from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import MeasurementSet


@dataclass(frozen=True, eq=False)
class OtherAnswer:
    """A model with the effects of an answer in it, fitted with white forces on its balances, beside the model as given.

    `parameters` of it were fitted; `unexplained` is the share of the disturbing forces' power that is left, 0 to 1, as in the answers of the grey box.
    """

    own: FittedSet
    parameters: int
    unexplained: float

    def gives_way_to(self, other: FittedSet, limits: Thresholds) -> bool:
        """Whether another set makes the learning trials more probable beyond doubt, with no more parameters.

        With more of them, it explains more of any record: a pendulum's viscous friction gave way to drag, dry friction and gravity.
        """
        return other.counted <= self.parameters and beyond_doubt(other, self.own, limits)


def other_answer(
    given: ModelicaModel, answer: ModelicaModel, parameters: int, measurements: MeasurementSet, limits: Thresholds
) -> OtherAnswer:
    """Fit the noise of a model as given and of one with an answer's effects, which has so many fitted `parameters`.

    Raises:
        MisfitError: if the data do not fit the model.
        ComponentError: if the filter cannot follow the record.
    """
    setting, nominal = nominal_set(case_of(given, measurements), limits)
    _, own = nominal_set(case_of(answer, measurements), limits)
    scale = np.nanstd(np.concatenate([trial.measured for trial in setting.trials]), axis=0)
    unexplained = 1.0 - Judge(nominal, limits, np.maximum(scale, 1e-300)).explained(own)
    return OtherAnswer(replace(own, before=parameters), parameters, unexplained)
