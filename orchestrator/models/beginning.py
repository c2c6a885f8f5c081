"""Value and speed at the first sample of a record, with how far they may be off."""

from dataclasses import dataclass, replace

import numpy as np

DEGREE = 3
# Samples of the shortest stretch that is fitted, and by how much the next longer one exceeds it.
SHORTEST = 8
GROWTH = 1.5
# A stretch is too long for the polynomial if its residual exceeds the noise by this many standard deviations.
TOO_MUCH = 1.5
# Where even the shortest stretch leaves this many times the noise, it bends.
UNDERSTATED = 1.3
# What bends is off at its end by this many times what it is off inside.
BEND = 3.0


@dataclass(frozen=True)
class Beginning:
    """First value and speed of a signal, with standard deviations, in its unit and its unit per s."""

    value: float
    speed: float
    value_std: float
    speed_std: float

    def within(self, value_std: float, speed_std: float) -> "Beginning":
        """The same with standard deviations of at least these."""
        return replace(self, value_std=max(self.value_std, value_std), speed_std=max(self.speed_std, speed_std))


def beginning(time: np.ndarray, series: np.ndarray, noise: float) -> Beginning:
    """Fit a cubic to the first samples of a signal, over a stretch on which it holds within the noise.

    A smoother bends at the ends of a record, and a difference there lags by half a sample; a polynomial does neither.
    Longer and longer stretches are fitted until one leaves more than the noise (Lepski, Theory Probab. Appl. 35, 1990).
    The standard deviations are those of least squares, not less than three times what the last two stretches differ by.

    Args:
        time: (n,) s, increasing, n >= 2.
        series: (n,).
        noise: standard deviation of white noise; where it is understated, what the shortest stretch leaves.
    """
    kept: list[Beginning] = []
    length, scale = float(min(SHORTEST, len(time))), noise
    while int(length) <= len(time):
        count = int(length)
        found, left = _polynomial(time[:count], series[:count], scale)
        freedom = max(count - 1 - DEGREE, 1)
        if not kept:
            bends, scale = left > UNDERSTATED * noise, max(noise, left)
            found, _ = _polynomial(time[:count], series[:count], scale * (BEND if bends else 1.0))
        elif (left / scale) ** 2 > 1 + TOO_MUCH * np.sqrt(2 / freedom):
            break
        kept.append(found)
        length *= GROWTH
    # The longest stretch may be off already by as much as its own standard deviations allow: the one before is taken.
    last, chosen = kept[-1], kept[max(len(kept) - 2, 0)]
    return Beginning(
        chosen.value,
        chosen.speed,
        max(chosen.value_std, BEND * abs(last.value - chosen.value), noise),
        max(chosen.speed_std, BEND * abs(last.speed - chosen.speed)),
    )


def _polynomial(time: np.ndarray, series: np.ndarray, noise: float) -> tuple[Beginning, float]:
    """Fit of one stretch, and the standard deviation of what it leaves."""
    span = time[-1] - time[0]
    degree = min(DEGREE, len(time) - 1)
    powers = ((time - time[0]) / span)[:, None] ** np.arange(degree + 1)
    found, *_ = np.linalg.lstsq(powers, series, rcond=None)
    spread = np.sqrt(np.diag(np.linalg.inv(powers.T @ powers))) * noise
    left = series - powers @ found
    freedom = max(len(time) - 1 - degree, 1)
    fitted = Beginning(float(found[0]), float(found[1] / span), float(spread[0]), float(spread[1] / span))
    return fitted, float(np.sqrt(left @ left / freedom))
