"""FMUs of models with nonlinear equations: steps, derivatives, and what they say where there is no solution."""

from ctypes import byref, c_double, c_size_t
from pathlib import Path

import numpy as np
import pytest
from helpers_slave import DISCARD, ERROR, MODEL_EXCHANGE, Slave

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu

# z is the real root of z + z^3 = x, so der(z)*(1 + 3 z^2) = -z.
CUBIC = "model A Real x(start=2, fixed=true); output Real z; equation der(x) = -z; z + z^3 = x; end A;"
# x falls to zero at t = 1, and no y exists after that.
ROOT = "model A Real x(start=1, fixed=true); output Real y(start=1); equation der(x) = -1 + 0*y; y^2 = x; end A;"


def build(text: str, folder: Path) -> Path:
    file = folder / "probe.mo"
    file.write_text(text)
    return build_fmu(ModelicaModel("A", "A", file).compile(), folder / "A.fmu")


def test_a_step_keeps_the_implicit_equation_and_its_closed_form(tmp_path: Path) -> None:
    with Slave(build(CUBIC, tmp_path), tmp_path / "x").start(1e-10) as slave:
        z0 = slave.get("z")
        slave.step(0.5)
        z, x = slave.get("z"), slave.get("x")

    # Separation of variables: ln(z) + 3/2 z^2 falls by one per second.
    assert z + z**3 == pytest.approx(x, rel=1e-12)
    assert np.log(z) + 1.5 * z**2 == pytest.approx(np.log(z0) + 1.5 * z0**2 - 0.5, rel=1e-8)


def test_directional_derivative_passes_through_the_iteration(tmp_path: Path) -> None:
    with Slave(build(CUBIC, tmp_path), tmp_path / "x").start(1e-10) as slave:
        z = slave.get("z")
        assert slave.directional(["z"], ["x"], [1.0])[0] == pytest.approx(1 / (1 + 3 * z**2), rel=1e-12)


def test_a_step_without_a_solution_is_refused_with_the_names_of_the_unknowns(tmp_path: Path) -> None:
    coupled = ROOT.replace("0*y", "0.001*y")
    with Slave(build(coupled, tmp_path), tmp_path / "x").start() as slave:
        slave.step(0.5)
        status = slave.call("fmi2DoStep", c_double(0.5), c_double(1.0), 1)

        assert status in (ERROR, DISCARD)
        assert "no solution of the equations for 'y' was found at t = 1.00" in slave.messages[-1]
        assert slave.get("y") ** 2 == pytest.approx(slave.get("x"), rel=1e-12)


def test_reading_an_unknown_without_a_solution_is_an_error_with_its_name(tmp_path: Path) -> None:
    with Slave(build(ROOT, tmp_path), tmp_path / "x").start() as slave:
        slave.step(1.5)
        status = slave.call("fmi2GetReal", *slave.one("y"), byref(c_double()))

    assert status == ERROR
    assert "no solution of the equations for 'y' was found at t = 1.5 s" in slave.messages[-1]


def test_an_importer_is_asked_for_a_shorter_step_where_no_solution_exists(tmp_path: Path) -> None:
    coupled = ROOT.replace("0*y", "0.001*y")
    with Slave(build(coupled, tmp_path), tmp_path / "x", MODEL_EXCHANGE).start() as slave:
        slave.insist("fmi2EnterContinuousTimeMode")
        slave.insist("fmi2SetContinuousStates", byref(c_double(-0.1)), c_size_t(1))
        status = slave.call("fmi2GetDerivatives", byref(c_double()), c_size_t(1))

    assert status == DISCARD
    assert "no solution of the equations for 'y'" in slave.messages[-1]
