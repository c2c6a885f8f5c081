"""How soon the motors make no torque after a fault, in virtual time; `tests.benchmarks.hil.hil_faults` measures all of them."""

import pytest

from tests.benchmarks.hil.bus_faults import FAULTS, times_of

BY_NAME = {fault.name: fault for fault in FAULTS}


@pytest.mark.parametrize(
    ("name", "rate_hz", "most_ms", "told"),
    [
        ("the controller asks for NaN", 500.0, 6.0, "finite_command"),
        ("the watchdog falls silent", 1000.0, 3.0, "the watchdog has fallen silent"),
        ("all positions 2.3 periods late", 500.0, 35.0, "come too late or not at all"),
        ("all torque frames lost on the way", 500.0, 250.0, "joint 3 has not followed"),
        ("an encoder that jumps by 0.3 rad", 100.0, 60.0, "jumped by 0.3 rad"),
    ],
)
def test_after_a_fault_no_motor_makes_torque_any_more_within_a_bounded_time(
    name: str, rate_hz: float, most_ms: float, told: str
) -> None:
    found = times_of(BY_NAME[name], rate_hz, trial=0)
    assert 0.0 < found.zero_ms <= most_ms
    assert told in found.told
