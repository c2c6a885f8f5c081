"""Directional derivatives of FMUs, against CasADi's Jacobian and central differences through the FMU itself."""

import math
from collections.abc import Callable
from ctypes import byref, c_double, c_size_t, c_uint
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from helpers_slave import ERROR, Slave
from helpers_systems import lag, oscillator

from fmus.catalogue import find_modelica_model
from fmus.layout import Layout
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem

SYSTEMS: dict[str, Callable[[], SymbolicSystem]] = {
    "lag": lag,
    "oscillator": oscillator,
    "arm": lambda: find_modelica_model("arm").compile(),
}


@pytest.fixture(scope="module")
def systems() -> dict[str, SymbolicSystem]:
    return {name: make() for name, make in SYSTEMS.items()}


@pytest.fixture(scope="module")
def fmus(systems: dict[str, SymbolicSystem], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {name: build_fmu(system, folder / f"{name}.fmu") for name, system in systems.items()}


def initialising(fmu: Path, folder: Path, values: dict[str, float]) -> Slave:
    """A slave in initialization mode, where everything may be set."""
    slave = Slave(fmu, folder)
    slave.insist("fmi2SetupExperiment", 0, c_double(0.0), c_double(0.0), 0, c_double(0.0))
    slave.set(**values)
    slave.insist("fmi2EnterInitializationMode")
    return slave


def point(system: SymbolicSystem) -> dict[str, float]:
    """Inputs and states near their starts, the same at every call."""
    random = np.random.default_rng(5)
    return {v.name: (v.start or 0.0) + 0.1 * random.uniform(0.5, 1) for v in (*system.inputs, *system.states)}


def columns(slave: Slave, unknowns: list[str], knowns: list[str]) -> np.ndarray:
    return np.column_stack([slave.directional(unknowns, [known], [1.0]) for known in knowns])


@pytest.mark.parametrize("name", SYSTEMS)
def test_derivatives_by_states_inputs_and_parameters_are_the_jacobian(
    systems: dict[str, SymbolicSystem], fmus: dict[str, Path], name: str, tmp_path: Path
) -> None:
    system, values = systems[name], point(systems[name])
    x = [values[v.name] for v in system.states]
    u = [values[v.name] for v in system.inputs]
    p = [v.start for v in system.parameters]
    t = 0.0  # nothing is in the past yet: delay operators give the present
    symbols = [ca.SX.sym(n, size) for n, size in zip("xup", (len(x), len(u), len(p)), strict=True)]
    sources = system.history(0.0, symbols[1], symbols[2])[0]
    results = ca.vertcat(*system.rhs(t, symbols[0], symbols[1], sources, symbols[2]))
    jacobian = ca.Function("jacobian", symbols, [ca.jacobian(results, ca.vertcat(*symbols))])(x, u, p).full()
    scalars = Layout(system).scalars
    unknowns = [s.variable.name for s in scalars if s.derivative_of is not None]
    unknowns += [v.name for v in system.algebraics]
    knowns = [v.name for v in (*system.states, *system.inputs, *system.parameters)]

    with initialising(fmus[name], tmp_path / name, values) as slave:
        found = columns(slave, unknowns, knowns)

    scale = 1e-12 * max(1.0, np.abs(jacobian).max())
    np.testing.assert_allclose(found, jacobian, rtol=1e-9, atol=scale)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_direction_agrees_with_central_differences_through_the_fmu(
    systems: dict[str, SymbolicSystem], fmus: dict[str, Path], name: str, tmp_path: Path
) -> None:
    system, values = systems[name], point(systems[name])
    unknowns = [*system.outputs, *(f"der({v.name})" for v in system.states)]
    direction = dict(zip(values, np.random.default_rng(6).normal(size=len(values)), strict=True))
    step = 1e-5
    with initialising(fmus[name], tmp_path / name, values) as slave:
        exact = slave.directional(unknowns, list(direction), list(direction.values()))
        ends = []
        for sign in (1, -1):
            slave.set(**{k: values[k] + sign * step * direction[k] for k in values})
            ends.append([slave.get(unknown) for unknown in unknowns])
    difference = (np.array(ends[0]) - np.array(ends[1])) / (2 * step)

    # The differences themselves are good to step^2 and to rounding / step.
    np.testing.assert_allclose(exact, difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())


def test_start_values_and_dependents_follow_the_parameters_until_the_start(
    fmus: dict[str, Path], tmp_path: Path
) -> None:
    with initialising(fmus["oscillator"], tmp_path / "o", {}) as slave:
        assert slave.directional(["q", "energy"], ["swing"], [2.0]) == pytest.approx([1.0, 9.0 * 0.5])
        slave.set(q=0.3)
        assert slave.directional(["q"], ["swing"], [2.0]) == [0.0]
        slave.insist("fmi2ExitInitializationMode")
        assert slave.directional(["q", "energy"], ["swing", "q"], [2.0, 1.0]) == pytest.approx([1.0, 9.0 * 0.3])
    with initialising(fmus["lag"], tmp_path / "l", {}) as slave:
        assert slave.directional(["rate"], ["tau"], [1.0]) == pytest.approx([-1 / 0.2**2])


@pytest.mark.parametrize(("delay", "by_input", "by_delay"), [(0.0, 1.0, 0.0), (0.05, 0.0, -2.0)])
def test_behind_a_delay_the_present_input_has_no_effect(
    fmus: dict[str, Path], tmp_path: Path, delay: float, by_input: float, by_delay: float
) -> None:
    with Slave(fmus["lag"], tmp_path / "lag").start(T=delay) as slave:
        slave.slope(u=2.0)
        slave.step(0.1)
        assert slave.directional(["late"], ["u"], [1.0]) == [by_input]
        assert slave.directional(["late"], ["T"], [1.0]) == pytest.approx([by_delay])
        assert slave.directional(["late"], ["time"], [1.0]) == pytest.approx([-by_delay])
        assert slave.directional(["der(x)"], ["u", "x"], [1.0, 1.0]) == pytest.approx([(by_input - 1.0) / 0.2])


def test_what_is_no_unknown_or_no_known_is_refused_by_name(fmus: dict[str, Path], tmp_path: Path) -> None:
    def ask(slave: Slave, unknown: int, known: int, seed: float = 1.0) -> int:
        change = byref(c_double())
        references = byref(c_uint(unknown)), c_size_t(1), byref(c_uint(known)), c_size_t(1)
        return slave.call("fmi2GetDirectionalDerivative", *references, byref(c_double(seed)), change)

    with Slave(fmus["lag"], tmp_path / "lag") as slave:
        u, x, rate = slave.references["u"], slave.references["x"], slave.references["der(x)"]
        assert ask(slave, x, u) == ERROR
        slave.start()
        assert [ask(slave, u, x), ask(slave, x, rate), ask(slave, 99, x), ask(slave, x, 99)] == [ERROR] * 4
        assert ask(slave, x, u, math.nan) == ERROR
        assert slave.messages == [
            "fmi2GetDirectionalDerivative: not allowed while the FMU is instantiated",
            "fmi2GetDirectionalDerivative: 'u' is not computed by the model and cannot be an unknown",
            "fmi2GetDirectionalDerivative: 'der(x)' is computed by the model and cannot be a known",
            "fmi2GetDirectionalDerivative: value reference 99 is unknown; this model has 0 to 7",
            "fmi2GetDirectionalDerivative: value reference 99 is unknown; this model has 0 to 7",
            "fmi2GetDirectionalDerivative: the seed nan is not a finite number",
        ]
