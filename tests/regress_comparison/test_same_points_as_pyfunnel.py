"""The same samples are outside as pyfunnel 2.1.1 finds outside.

What pyfunnel found is recorded here; `tests/benchmarks/regress/run.py` asks it anew, for many more curves.
"""

import numpy as np
import pytest

from orchestrator.regress.comparison import Signal, Tolerance, compare_signals
from tests.benchmarks.regress.run import outside_points
from tests.benchmarks.regress.signals import SmallCase, long_signal, small_case

# How many samples of small_case(seed) pyfunnel finds outside, and the sum of their indices.
RECORDED = [
    (0, 0), (153, 16829), (0, 0), (6, 132), (0, 0), (8, 1414), (0, 0), (80, 9369),
    (114, 17165), (9, 2134), (0, 0), (1, 12), (0, 0), (20, 3110), (0, 0), (3, 329),
    (0, 0), (149, 25279), (0, 0), (90, 6574), (0, 0), (3, 533), (0, 0), (216, 29740),
]  # fmt: skip


@pytest.mark.parametrize("seed", range(len(RECORDED)))
def test_the_same_samples_of_random_curves_are_outside(seed: int) -> None:
    outside = np.flatnonzero(outside_points(small_case(seed)))

    assert (len(outside), int(outside.sum())) == RECORDED[seed]


RAMP = ([0.0, 1.0, 1.2, 2.0], [0.0, 0.0, 1.0, 1.0])
PEAK = ([0.0, 1.0, 1.1, 1.5], [0.0, 0.0, 1.0, 0.0])
SAW = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 0.0, 1.0, 0.0])
# After the situations of pyfunnel's own success and fail cases: reference, result, half-width, half-height, outside.
SITUATIONS = {
    "a ramp comes early by the half-width": (RAMP, ([0.0, 0.9, 0.95, 1.1, 2.0], [0.0, 0.0, 0.25, 1.0, 1.0]), 0.1, 1e-6, []),
    "other stamps near an early ramp": (
        RAMP,
        ([0.0, 0.9, 0.95, 0.97, 0.98, 1.11, 1.2, 2.0], [0.0, 0.0, 0.0, -0.01, 0.02, 1.01, 1.0, 1.0]),
        0.1, 0.01, [],
    ),
    "a peak too low by a little": (PEAK, ([0.0, 1.0, 1.1, 1.5], [0.0, 0.0, 0.9, 0.0]), 1e-6, 0.099, [2]),
    "a peak just high enough": (PEAK, ([0.0, 1.0, 1.1, 1.5], [0.0, 0.0, 0.9, 0.0]), 1e-6, 0.101, []),
    "a saw, all late by the half-width": (SAW, ([0.0, 0.9, 2.1, 3.1, 4.0], [0.0, 1.0, 0.0, 1.0, 0.0]), 0.1, 1e-6, []),
    "a saw, later than the half-width": (SAW, ([0.0, 1.2, 2.2, 3.2, 4.0], [0.0, 1.0, 0.0, 1.0, 0.0]), 0.1, 0.05, [1, 2, 3]),
    "a saw, too high and too low": (SAW, ([0.0, 0.5, 1.5, 2.5, 4.0], [0.0, 0.8, 0.2, 0.4, 0.0]), 0.1, 0.1, [1, 2]),
}  # fmt: skip


@pytest.mark.parametrize("situation", SITUATIONS)
def test_the_same_samples_are_outside_in_known_situations(situation: str) -> None:
    reference, result, shift, height, outside = SITUATIONS[situation]
    case = SmallCase(situation, Signal("y", *reference, "V"), Signal("y", *result, "V"), shift, height)

    assert np.flatnonzero(outside_points(case)).tolist() == outside


def test_an_event_early_by_exactly_the_time_shift_passes_though_pyfunnel_fails_it() -> None:
    # pyfunnel keeps this among its own cases as one that should succeed.
    reference = Signal("y", [0.0, 1.0, 1.0, 2.0], [0.0, 0.0, 1.0, 1.0], "V")
    early = Signal("y", [0.0, 0.99, 0.99, 2.0], [0.0, 0.0, 1.01, 1.0], "V")

    assert compare_signals(early, reference, Tolerance(0.01, 0.0, 0.01)).passed
    assert not compare_signals(early, reference, Tolerance(0.01, 0.0, 0.009)).passed


def test_jumps_within_the_time_shift_pass_and_later_ones_fail_by_as_many_samples_as_they_are_too_late() -> None:
    tolerance = Tolerance(1e-3, 0.0, 2e-3)

    assert compare_signals(long_signal(1e-3), long_signal(), tolerance).passed
    late = compare_signals(long_signal(4e-3), long_signal(), tolerance)

    # 13 jumps, each 2 ms = 20 samples too late; pyfunnel counts the same 260.
    assert late.points_outside == 260
    assert late.event_shift_s == pytest.approx(4e-3) and late.amplitude_error < 2e-3
