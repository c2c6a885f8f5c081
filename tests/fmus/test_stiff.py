"""Co-simulation of stiff models: held friction, delays in front of a fast lag, snapshots in a stiff phase."""

import math
from collections.abc import Iterator
from ctypes import byref
from dataclasses import replace
from pathlib import Path

import casadi as ca
import pytest
from helpers_slave import Slave
from helpers_systems import lag, symbols

from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem, Variable

SHARPNESS = 1e-5  # rad/s


def held_shaft() -> SymbolicSystem:
    """`J der(w) = u - tanh(w/sharpness)`, J = 0.05 kg.m2, with `power = u w`."""
    t, x, u, d, p = symbols(states=1, inputs=1, delays=0, parameters=0)
    acceleration = (u - ca.tanh(x / SHARPNESS)) / 0.05
    return replace(
        lag(),
        name="HeldShaft",
        inputs=(Variable("u", "N.m"),),
        states=(Variable("w", "rad/s"),),
        algebraics=(Variable("power", "W"),),
        parameters=(),
        dependents=(),
        outputs=("w", "power"),
        rhs=ca.Function("rhs", [t, x, u, d, p], [acceleration, u * x]),
        history=ca.Function("history", [t, u, p], [ca.SX(0, 1), ca.SX(0, 1)]),
        dependent=ca.Function("dependent", [p], [ca.SX(0, 1)]),
        initial=ca.Function("initial", [p], [ca.SX(1, 1)]),
    )


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    systems = {"lag": lag(), "shaft": held_shaft()}
    return {name: build_fmu(system, folder / f"{name}.fmu") for name, system in systems.items()}


@pytest.fixture
def shaft(fmus: dict[str, Path], tmp_path: Path) -> Iterator[Slave]:
    with Slave(fmus["shaft"], tmp_path / "shaft") as slave:
        yield slave.start(u=0.0)


def test_held_friction_creeps_as_its_law_says(shaft: Slave) -> None:
    for load in (0.2, 0.5, -0.9):
        shaft.set(u=load)
        for _ in range(10):
            shaft.step(0.1)
        assert shaft.get("w") == pytest.approx(SHARPNESS * math.atanh(load), rel=1e-9)
    shaft.set(u=1.5)  # breaks away: at once the friction is complete
    start = shaft.get("w")
    shaft.step(0.5)
    # On its way from the creep to the slip it is a little less than complete, by sharpness J/0.5 log(...) < 1e-6.
    assert shaft.get("w") - start == pytest.approx(0.5 * 0.5 / 0.05, abs=1e-4)


@pytest.mark.parametrize("tau", [1e-2, 1e-4, 1e-6])
def test_a_delayed_ramp_passes_a_fast_lag(fmus: dict[str, Path], tmp_path: Path, tau: float) -> None:
    with Slave(fmus["lag"], tmp_path / "lag").start(tau=tau, T=0.1, u=0.0) as slave:
        for step in (0.25, 0.05, 0.2, 0.001, 0.5):
            slave.slope(u=2.0)
            slave.step(step)
        ramp = slave.time - 0.1 - tau * (1.0 - math.exp(-(slave.time - 0.1) / tau))
        assert slave.get("x") == pytest.approx(2.0 * ramp, abs=1e-7)


def test_a_restored_stiff_run_gives_the_same_bits(shaft: Slave) -> None:
    shaft.set(u=0.3)
    for _ in range(30):
        shaft.step(0.01)
    state, time = shaft.save(), shaft.time
    content = shaft.to_bytes(state)
    runs = []
    for kept in (None, state, shaft.from_bytes(content)):
        if kept is not None:
            shaft.insist("fmi2SetFMUstate", kept)
            shaft.insist("fmi2FreeFMUstate", byref(kept))
            shaft.time = time
        shaft.set(u=0.3)
        values = []
        for k in range(20):
            shaft.set(u=0.3 + 0.02 * k)
            shaft.step(0.01)
            values.append((shaft.get("w"), shaft.get("power")))
        runs.append(values)
    assert runs[0] == runs[1] == runs[2]
