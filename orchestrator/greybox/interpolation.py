"""Whether inputs are held from sample to sample or run in straight lines, asked again with what was found in the model."""

from collections.abc import Sequence

from fmus.errors import ComponentError
from orchestrator.greybox.diagnose import Outcome
from orchestrator.greybox.extended import extend
from orchestrator.greybox.filtering import GreyBox
from orchestrator.greybox.search import with_losses


def held_otherwise(outcome: Outcome, asked: Sequence[str]) -> dict[str, float]:
    """Inputs that run otherwise between samples than was assumed, by the likelihood of the chosen set.

    A model that lacks much predicts so badly that half a sample of an input makes no difference; with what it lacked, it does.

    Args:
        outcome: a search that is over.
        asked: names of inputs that were measured and whose course between samples nobody has said.

    Returns:
        By input the nats that the record gains, each with those before it turned.
    """
    case, fit, setting = outcome.case, outcome.decision.chosen.fit, outcome.setting
    candidates = outcome.decision.chosen.candidates
    extended = extend(case.base, case.balances, case.signals, candidates)
    held, loss, found = list(setting.held), outcome.decision.chosen.loss, dict[str, float]()
    for name in asked:
        other = [each for each in held if each != name] if name in held else [*held, name]
        box = GreyBox(
            extended.system,
            extended.outputs,
            extended.balances,
            fit.box.theta,
            tuple(other),
            extended.begin,
            extended.unsure,
        )
        try:
            again = with_losses(candidates, setting.fitter.fit(box, fit.theta, fit.priors, fit.noise)).loss
        except ComponentError:  # the model does not run so
            continue
        if loss - again > setting.thresholds.nats:
            found[name] = loss - again
            held, loss = other, again
    return found
