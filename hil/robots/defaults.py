"""Limits where a bench file says nothing else: the usual ones, with times that leave a few cycles at low rates."""

from fmus.errors import MisfitError
from hil.safety.limits import JointLimits, Limits

SLOWEST_HZ, FASTEST_HZ = 10.0, 1000.0


def limits_of(joints: tuple[JointLimits, ...], rate_hz: float, unexplained: float) -> Limits:
    """Limits of a session: one lost answer must not stop the arm, whatever the rate.

    Args:
        unexplained: rad/s by which a joint may speed up though nothing known pushes it.

    Raises:
        MisfitError: if the rate is not between 10 and 1000 Hz.
    """
    if not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        raise MisfitError(f"a rate of {rate_hz:g} Hz is outside [{SLOWEST_HZ:g}, {FASTEST_HZ:g}] Hz")
    period = 1.0 / rate_hz
    usual = Limits(joints)
    return Limits(
        joints,
        period_ns=round(1e9 * period),
        missing_comply_s=max(usual.missing_comply_s, 2.5 * period),
        missing_release_s=max(usual.missing_release_s, 4.5 * period),
        late_comply_s=max(usual.late_comply_s, 5 * period),
        force_missing_s=max(usual.force_missing_s, 3.5 * period),
        unexplained=unexplained,
    )
