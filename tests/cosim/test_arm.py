"""The arm as one FMU and as a linkage with six muscles: the same trajectory but for the error of the coupling."""

from pathlib import Path

import numpy as np
import pytest
from systems import recorded

from orchestrator.cosim import System, Value
from orchestrator.cosim.load import load_system
from orchestrator.cosim.ssp import read_ssp, write_ssp

ACTIVATIONS = (0.3, 0.1, 0.2, 0.15, 0.05, 0.25)
FINEST = 0.001


def activated(system: System) -> System:
    addresses = [system.inputs[f"alpha_{k}"][0] for k in range(1, 7)]
    return system.with_values(dict(zip(addresses, map(Value, ACTIVATIONS), strict=True)))


@pytest.fixture(scope="module")
def parts() -> System:
    return activated(load_system(Path(__file__).parent / "arm.toml"))


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    found = recorded(activated(load_system("arm")), 1.0, step=FINEST)
    return np.column_stack([found["arm.q1"], found["arm.q2"]])


def coupling_error(parts: System, whole: np.ndarray, step: float, master: str) -> float:
    """Largest distance of the angles within 1 s, rad."""
    found = recorded(parts, 1.0, step=step, master=master)
    angles = np.column_stack([found["arm.q1"], found["arm.q2"]])
    return float(np.abs(angles - whole[:: round(step / FINEST)]).max())


@pytest.mark.parametrize(
    # Forces that are held over a step are late by half of it on average; the iterative master holds their mean instead.
    ("master", "order", "at_a_millisecond"),
    [("ordered", 1, 1.4e-3), ("iterative", 2, 5e-6)],
)
def test_the_arm_in_parts_moves_as_the_whole_arm(parts, whole, master, order, at_a_millisecond):
    errors = [coupling_error(parts, whole, step, master) for step in (0.004, 0.002, FINEST)]
    assert errors[-1] < at_a_millisecond
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.allclose(slopes, order, atol=0.05)
    assert np.ptp(whole[:, 0]) > 0.5  # rad: it does move


def test_the_arm_in_parts_travels_as_ssp(parts, tmp_path):
    again = read_ssp(write_ssp(parts, tmp_path / "arm.ssp"))
    one, other = recorded(parts, 0.1), recorded(again, 0.1)
    assert np.array_equal(one["arm.q2"], other["arm.q2"])
