"""Does a set explain an error, or does it take noise of measured inputs away?

A ceiling just below the highest command cuts the noise of its record there, and the free run errs less, though nothing
is cut off in truth: what drives the model is the record, noise and all. So a set that explains less than there is noise
is judged by what it does along inputs without their noise.
"""

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.linear.noise_free_motion import noise_free_motion, started_like
from orchestrator.diagnosis.linear.tangent import Tangent
from orchestrator.diagnosis.linear.thresholds import MOSTLY


def misfit_without_input_noise(tangent: Tangent, found: Refit) -> float:
    """Misfit of a set, were the noise of the inputs carried as in the smaller set that `tangent` tests.

    That is the smaller set's error along the recorded inputs, changed by what the larger one changes along noise-free ones.
    Where noise acts alike in both, as in any linear model, it is the misfit of the fit. What the larger set leaves says
    which noise there was: to the smaller one, an effect is noise of the inputs as far as that can imitate it, and a
    motion that both move, the noise and the effect, is out of step with waves of cogging.
    """
    base, learning, rows = tangent.base, tangent.learning, tangent.base.fit.rows
    left, _ = linearised(found, learning)
    noise_free = noise_free_motion(found, learning, left, tangent.machine_states)
    before = started_like(base, found, noise_free)
    after, _ = linearised(noise_free, learning)
    errors = tangent.recorded_error[:rows] + after[:rows] - linearised(before, learning)[0][:rows]
    return float(errors @ errors) + found.fit.prior_cost


def carries_noise(learning: LearningData) -> bool:
    """Whether some input of the trials is measured with noise that shows in the outputs."""
    return any(metric.noisy_inputs for metric in learning.metrics)


def explained_by_noise(tangent: Tangent, found: Refit, noise: float, charge: float) -> bool:
    """Whether a set is no better than the smaller one that `tangent` tests, once noise of inputs is left to both, or by
    less than half of what it seems: noise-free inputs still hold some noise.

    Args:
        noise: power of the noise in the metric.
        charge: what the set must lower half the misfit by, in units of that power.
    """
    before = tangent.base
    if not carries_noise(tangent.learning) or before.cost - found.cost >= noise:
        return False
    try:
        gain = before.fit.misfit - misfit_without_input_noise(tangent, found)
    except ComponentError:  # along noise-free inputs it may leave the finite numbers where noise kept it from that
        return False
    return gain < max(2.0 * noise * charge, MOSTLY * (before.fit.misfit - found.fit.misfit))
