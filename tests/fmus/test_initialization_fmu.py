"""FMUs that solve for their start: what may be set, what follows, derivatives through the solution, XML."""

from ctypes import byref, c_double
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import pytest
from helpers_slave import ERROR, Slave

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu

# At rest u = k x^3; b starts at 2 c and the parameter m makes y equal to 12 at the start.
STEADY = """model A
  input Real u(start=3); parameter Real k = 2; parameter Real c = 1.5;
  parameter Real m(fixed=false, start=1);
  Real x(start=1); Real b(start=2*c, fixed=true); Real a(start=0.25, fixed=true); output Real y;
initial equation
  der(x) = 0; y = 12;
equation
  der(x) = u - k*x^3; der(b) = -b; der(a) = -a; y = m*(b + a);
end A;
"""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("steady")
    (folder / "probe.mo").write_text(STEADY)
    return build_fmu(ModelicaModel("A", "A", folder / "probe.mo").compile(), folder / "A.fmu")


def initialising(fmu: Path, folder: Path, **values: float) -> Slave:
    slave = Slave(fmu, folder)
    slave.insist("fmi2SetupExperiment", 0, c_double(0.0), c_double(0.0), 0, c_double(0.0))
    slave.insist("fmi2EnterInitializationMode")
    slave.set(**values)
    return slave


def test_the_start_follows_what_is_set_before_the_run(fmu: Path, tmp_path: Path) -> None:
    with initialising(fmu, tmp_path / "x", k=0.5, c=2.0, a=1.0) as slave:
        slave.set(u=4.0)
        first = slave.get("x")
        slave.set(u=13.5)
        slave.insist("fmi2ExitInitializationMode")

        assert first == pytest.approx(2.0, rel=1e-12)
        assert [slave.get(name) for name in ("x", "b", "a", "m", "y")] == pytest.approx([3, 4, 1, 2.4, 12], rel=1e-12)
        slave.step(1.0)
        assert slave.get("x") == pytest.approx(3.0, rel=1e-9)
        assert slave.get("m") == pytest.approx(2.4, rel=1e-12)


def test_a_start_value_that_is_set_is_the_guess_of_a_solution(tmp_path: Path) -> None:
    text = "model A Real x(start=1); initial equation x^2 = 4; equation der(x) = 0*x; end A;"
    (tmp_path / "probe.mo").write_text(text)
    fmu = build_fmu(ModelicaModel("A", "A", tmp_path / "probe.mo").compile(), tmp_path / "A.fmu")

    with initialising(fmu, tmp_path / "x", x=-1.0) as slave:
        assert slave.get("x") == pytest.approx(-2.0, rel=1e-12)
        slave.set(x=5.0)
        assert slave.get("x") == pytest.approx(2.0, rel=1e-12)


def test_derivatives_at_the_start_pass_through_its_solution(fmu: Path, tmp_path: Path) -> None:
    with initialising(fmu, tmp_path / "x") as slave:
        x = slave.get("x")
        by_u, by_k = (slave.directional(["x"], [known], [1.0])[0] for known in ("u", "k"))
        by_c, by_a = (slave.directional(["m"], [known], [1.0])[0] for known in ("c", "a"))

    assert by_u == pytest.approx(1 / (6 * x**2), rel=1e-10)
    assert by_k == pytest.approx(-x / 6, rel=1e-10)
    # m = 12 / (2 c + a)
    assert by_c == pytest.approx(-24 / 3.25**2, rel=1e-10)
    assert by_a == pytest.approx(-12 / 3.25**2, rel=1e-10)


def test_the_description_tells_guesses_from_given_values_and_what_follows_from_what(fmu: Path) -> None:
    description = fmpy.read_model_description(str(fmu), validate=True)
    variables = {v.name: v for v in description.modelVariables}
    unknowns = {u.variable.name: {v.name for v in u.dependencies} for u in description.initialUnknowns}

    assert {name: variables[name].initial for name in "xbam"} == {
        "x": "approx",
        "b": "approx",
        "a": "exact",
        "m": "approx",
    }
    assert float(variables["x"].start) == 1.0
    assert unknowns["x"] == {"u", "k"}
    assert unknowns["b"] == {"c"}
    assert unknowns["m"] == {"c", "a"}
    assert "a" not in unknowns


def test_a_start_without_a_solution_is_an_error_with_the_name_of_the_state(fmu: Path, tmp_path: Path) -> None:
    text = "model A input Real u(start=4); Real x(start=1); initial equation x^2 = u; equation der(x) = 0*x; end A;"
    (tmp_path / "probe.mo").write_text(text)
    fmu = build_fmu(ModelicaModel("A", "A", tmp_path / "probe.mo").compile(), tmp_path / "A.fmu")

    with initialising(fmu, tmp_path / "x", u=-1.0) as slave:
        assert slave.call("fmi2GetReal", *slave.one("x"), byref(c_double())) == ERROR
        assert slave.call("fmi2ExitInitializationMode") == ERROR

    assert "no start value of 'x' was found" in slave.messages[-1]
