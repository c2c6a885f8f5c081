"""Effects that only the tanks have."""

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.run import Injection


def leak(context: Context) -> Sized:
    """A hole in the bottom of one tank; what leaks does not arrive in the other."""
    k = int(context.random.integers(1, 3))
    return lambda s: Injection("leak", f"tank{k}", {f"leak[{k}]": 1e-7 * s}, {f"leak{k}": 1e-7 * s})


def outlet_error(context: Context) -> Sized:
    """One outlet lets through more or less than its data say."""
    k, sign = int(context.random.integers(1, 3)), context.random.choice([-1.0, 1.0])
    area = context.machine.values[f"a{k}"]

    def sized(s: float) -> Injection:
        factor = 1 + sign * 0.6 * s / (s + 200)
        return Injection("outlet_error", f"outlet{k}", {f"factor[{k}]": factor}, {f"a{k}": area * factor})

    return sized
