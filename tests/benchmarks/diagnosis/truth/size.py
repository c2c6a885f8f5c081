"""How large an effect is against the noise, and the size at which it is as large as wanted."""

from collections.abc import Sequence

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Sized
from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.truth.run import Injection, nominal_run, run_trial

SMALLEST, LARGEST = 1e-7, 1e4


def effect_to_noise(
    machine: Machine, plans: Sequence[Plan], injections: Sequence[Injection], output_noise: float
) -> float:
    """ENR: rms over trials and signals of (run with the effects - nominal free run), over the sensors' noise.

    The nominal machine starts from the true state at the beginning of the record and is driven by the inputs as a
    perfect recorder shows them; what a fit of start values could take away is not taken away.
    """
    squares = []
    for plan in plans:
        run = run_trial(machine, plan, injections)
        squares.append(np.mean((run.outputs - nominal_run(machine, run, run.recorded)) ** 2))
    return float(np.sqrt(np.mean(squares))) / output_noise


def sized_to(
    machine: Machine, plans: Sequence[Plan], effect: Sized, wanted: float, output_noise: float
) -> tuple[Injection, float]:
    """The effect at the size at which its ENR is `wanted`, within 5 % or as near as its bounds allow, and its ENR."""
    size, power = 1.0, 1.0
    last: tuple[float, float] | None = None
    best: tuple[float, Injection, float] | None = None
    for _ in range(10):
        injection = effect(size)
        try:
            found = effect_to_noise(machine, plans, [injection], output_noise)
        except TruthError:
            size *= 0.2
            last = None
            continue
        off = abs(np.log(max(found, 1e-12) / wanted))
        if best is None or off < best[0]:
            best = (off, injection, found)
        if off < 0.05:
            break
        if last is not None and abs(np.log(size / last[0])) > 1e-9:
            slope = np.log(max(found, 1e-12) / max(last[1], 1e-12)) / np.log(size / last[0])
            power = float(np.clip(slope, 0.3, 3.0))
            if abs(slope) < 0.05:
                break  # a bound of the effect is reached
        last = (size, found)
        change = np.clip((wanted / max(found, 1e-12)) ** (1 / power), 0.02, 50.0)
        size = float(np.clip(size * change, SMALLEST, LARGEST))
    if best is None:
        raise TruthError(f"{machine.name}: the effect makes the machine leave all bounds at any size")
    return best[1], best[2]
