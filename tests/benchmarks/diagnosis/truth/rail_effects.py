"""Effects under the wheels of the cart, whose card has a law of its own for slides."""

from collections.abc import Callable

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.run import Injection

_SITE = "slide1"
_FORCE_N = 0.01


def hinge_or_rail(hinge: Callable[[Context], Sized], rail: Callable[[Context], Sized]) -> Callable[[Context], Sized]:
    """The one or the other by chance."""
    return lambda context: (hinge if context.random.random() < 0.5 else rail)(context)


def viscous_friction(context: Context) -> Sized:
    """Force -b v."""
    b = _FORCE_N / max(context.speed(1), 0.1)
    return lambda s: Injection("viscous_friction", _SITE, {"b[1]": s * b}, {"b2": s * b})


def coulomb_friction(context: Context) -> Sized:
    """Dry friction that holds the cart at rest exactly."""
    return lambda s: Injection("coulomb_friction", _SITE, {"fC[1]": s * _FORCE_N}, {"c2": s * _FORCE_N})


def stribeck_friction(context: Context) -> Sized:
    """Dry friction with a breakaway part that fades with speed."""
    extra, vs = context.random.uniform(0.8, 2.0), context.random.uniform(0.1, 0.3) * max(context.speed(1), 0.1)

    def sized(s: float) -> Injection:
        size = s * _FORCE_N
        named = {"fC[1]": size, "fExtra[1]": size * extra, "vS": vs}
        return Injection("stribeck_friction", _SITE, named, {"c2": size, "s2": size * extra, "vs": vs})

    return sized


def drag(context: Context) -> Sized:
    """Force -c |v| v."""
    c = _FORCE_N / max(context.speed(1), 0.1) ** 2
    return lambda s: Injection("quadratic_drag", _SITE, {"c[1]": s * c}, {"d2": s * c})
