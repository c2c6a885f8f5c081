"""Whether a set leaves nothing: no force has to disturb the model any more, and what its runs miss is white."""

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from fmus.errors import ComponentError
from orchestrator.greybox.fit import Fit, Fitter

# Numbers of the slowest frequencies whose power is compared with that of white noise, and how often chance makes it seem more.
SLOWEST, BY_CHANCE = (4, 16, 64), 1e-3


def leaves_nothing(fitter: Fitter, fit: Fit, quiet: float) -> bool:
    """Whether the record is hardly likelier with disturbing forces than without, and errors without them are white.

    Args:
        fitter: what the set was fitted with.
        fit: the set's fit.
        quiet: nats that disturbing forces have to bring for each balance.
    """
    silent, _ = fitter.without_disturbance(fit.box, fit)
    if fit.log_likelihood - silent >= quiet * max(len(fit.box.balances), 1):
        return False
    nothing = np.zeros(len(fit.box.balances))
    try:
        runs = [fit.box.run(t, fit.theta, nothing, n.sensors) for t, n in zip(fit.trials, fit.noise, strict=True)]
    except ComponentError:
        return False
    return all(is_white([run.innovation[:, k] for run in runs]) for k in range(runs[0].innovation.shape[1]))


def is_white(series: Sequence[np.ndarray]) -> bool:
    """Whether slow parts of some series are no stronger than those of white noise of their size, beyond chance.

    >>> random = np.random.default_rng(0)
    >>> noise = random.standard_normal(1000)
    >>> is_white([noise]), is_white([noise + 0.3 * np.sin(np.arange(1000) / 30)]), is_white([noise + 0.2])
    (True, False, False)
    """
    spectra = []
    for values in series:
        good = values[np.isfinite(values)]
        power = float(good @ good)
        if len(good) <= 2 * max(SLOWEST) or power <= 0:
            return False
        spectra.append(np.abs(np.fft.rfft(good)) ** 2 * np.r_[1.0, np.full(len(good) // 2, 2.0)] / power)
    strong = (
        sum(float(own[: count + 1].sum()) for own in spectra) > chdtri((2 * count + 1) * len(series), BY_CHANCE)
        for count in SLOWEST
    )
    return not any(strong)
