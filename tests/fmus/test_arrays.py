"""Modelica arrays are FMI 3.0 arrays: one variable, one reference, and the values of the FMI 2.0 elements."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException  # type: ignore[import-untyped]
from fmpy.fmi3 import FMU3Model, FMU3Slave  # type: ignore[import-untyped]
from helpers_fmi3 import derivative
from numpy.typing import NDArray

from fmus.archive import extract_fmu
from fmus.arrays import array_variables
from fmus.catalogue import ModelicaModel
from fmus.layout import Layout, Scalar
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem, Variable

# der(q) = A q + B u, y = C q: all answers are products of these matrices.
A = np.array([[0.0, 1.0], [-4.0, -0.5]])
MODEL = """
model Part
  parameter Real gain[2] = {2, 3};
  input Real q[2];
  output Real f = gain*q;
end Part;
model Linear "Linear system"
  import SI = FESArm.Units;
  parameter Real A[2,2] = {{0, 1}, {-4, -0.5}};
  input SI.Velocity u[2](each min=-5, each max=5, start={1, 2}) "Drive";
  SI.Length q[2](start={0.5, -0.25}, each fixed=true, each nominal=2) "Place";
  Real uneven[2](min={-1, -2}) = q;
  output Real y[3] = {q[1], 2*q[2], u[1]} "Seen";
  Part part[2];
equation
  der(q) = A*q + u;
  for i in 1:2 loop part[i].q = q; end for;
end Linear;
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> SymbolicSystem:
    file = tmp_path_factory.mktemp("model") / "Linear.mo"
    file.write_text(MODEL)
    return ModelicaModel("Linear", "Linear", file).compile()


@pytest.fixture(scope="module")
def fmu(system: SymbolicSystem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(system, tmp_path_factory.mktemp("fmu") / "linear.fmi3.fmu", fmi_version="3.0")


@contextmanager
def running(fmu: Path, folder: Path, kind: type = FMU3Slave) -> Iterator[tuple[FMU3Slave, dict[str, int], list[str]]]:
    """An initialised instance, its value references and its messages."""
    extract_fmu(fmu, folder)
    description = fmpy.read_model_description(str(folder))
    identifier = description.coSimulation.modelIdentifier
    messages: list[str] = []
    slave = kind(instanceName="i", guid=description.guid, unzipDirectory=str(folder), modelIdentifier=identifier)
    slave.instantiate(logMessage=lambda *args: messages.append(args[3].decode()))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    yield slave, {v.name: v.valueReference for v in description.modelVariables}, messages
    slave.fmi3FreeInstance(slave.component)


def values(slave: FMU3Slave, reference: int, size: int) -> NDArray[np.float64]:
    return np.array(slave.getFloat64([reference], size))


def described(fmu: Path) -> dict[str, Any]:
    return {v.name: v for v in fmpy.read_model_description(str(fmu)).modelVariables}


def test_an_array_is_one_variable_with_its_attributes(fmu: Path) -> None:
    variables = described(fmu)
    u, q = variables["u"], variables["q"]
    assert (u.dimensions[0].start, u.start, u.unit, float(u.min), float(u.max)) == (2, "1.0 2.0", "m/s", -5.0, 5.0)
    assert (q.description, float(q.nominal), q.unit, q.initial, q.start) == ("Place", 2.0, "m", "exact", "0.5 -0.25")
    assert (variables["der(q)"].derivative, variables["der(q)"].description) == (q, "Time derivative of q")
    assert [d.start for d in variables["A"].dimensions] == [2, 2]
    assert variables["A"].start.split() == ["0.0", "1.0", "-4.0", "-0.5"]


def test_component_arrays_and_uneven_ranges_stay_elements(fmu: Path) -> None:
    variables = described(fmu)
    assert {"part[1].f", "part[2].f", "uneven[1]", "uneven[2]"} <= set(variables)
    assert not variables["part[1].f"].dimensions
    assert [d.start for d in variables["part[2].gain"].dimensions] == [2]


def test_an_array_with_a_missing_or_moved_element_stays_elements() -> None:
    q1, q2, q3 = (Scalar(Variable(f"q[{k}]"), "local", "continuous") for k in (1, 2, 3))
    for scalars in ([q2, q3], [q2, q1], [q1, Scalar(Variable("x"), "local", "continuous"), q2]):
        assert [v.name for v in array_variables(scalars)] == [s.variable.name for s in scalars]


def test_references_and_sizes_cover_all_scalars(system: SymbolicSystem) -> None:
    scalars = Layout(system).scalars
    assert [e for v in array_variables(scalars) for e in v.elements] == scalars


def test_dependencies_are_those_of_the_elements(fmu: Path) -> None:
    description = fmpy.read_model_description(str(fmu))
    unknowns = [*description.outputs, *description.derivatives]
    assert {u.variable.name: {v.name for v in u.dependencies} for u in unknowns} == {
        "y": {"q", "u"},
        "der(q)": {"q", "u"},
    }


def test_arrays_are_read_and_set_as_a_whole(fmu: Path, tmp_path: Path) -> None:
    with running(fmu, tmp_path) as (slave, vr, _):
        slave.setFloat64([vr["u"]], [3.0, 4.0])
        q = values(slave, vr["q"], 2)
        assert list(q) == [0.5, -0.25]
        assert values(slave, vr["der(q)"], 2) == pytest.approx(A @ q + [3.0, 4.0])
        assert list(slave.getFloat64([vr["y"], vr["time"], vr["A"]], 8)) == [0.5, -0.5, 3.0, 0.0, *A.ravel()]


def test_a_list_of_the_wrong_length_is_refused(fmu: Path, tmp_path: Path) -> None:
    with running(fmu, tmp_path) as (slave, vr, messages):
        for call in (
            lambda: slave.getFloat64([vr["q"]], 1),
            lambda: slave.setFloat64([vr["u"]], [1.0, 2.0, 3.0]),
            lambda: slave.getFloat64([vr["q"] + 1], 1),
            lambda: slave.getDirectionalDerivative([vr["y"]], [vr["u"]], [1.0]),
            lambda: slave.getFloat64([10_000], 1),
        ):
            with pytest.raises(FMICallException):
                call()
        assert messages == [
            "fmi3GetFloat64: 1 values for variables with 2 elements",
            "fmi3SetFloat64: 3 values for variables with 2 elements",
            f"fmi3GetFloat64: value reference {vr['q'] + 1} is unknown",
            "fmi3GetDirectionalDerivative: 1 values for variables with 2 elements",
            "fmi3GetFloat64: value reference 10000 is unknown",
        ]


def test_derivatives_of_arrays_are_the_matrix_and_its_transpose(fmu: Path, tmp_path: Path) -> None:
    seed = np.array([0.3, -0.7])
    with running(fmu, tmp_path) as (slave, vr, _):
        rows, columns = [vr["der(q)"], vr["y"]], [vr["q"]]
        forward = derivative(slave, "fmi3GetDirectionalDerivative", rows, columns, seed, 5)
        weights = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
        adjoint = derivative(slave, "fmi3GetAdjointDerivative", rows, columns, weights, 2)
    matrix = np.vstack([A, [[1, 0], [0, 2], [0, 0]]])
    assert forward == pytest.approx(matrix @ seed)
    assert adjoint == pytest.approx(matrix.T @ weights)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_arrays_run_as_the_elements_of_the_second_version_do(
    system: SymbolicSystem, fmu: Path, tmp_path: Path, kind: str
) -> None:
    second = build_fmu(system, tmp_path / "second.fmu")
    scalars = fmpy.simulate_fmu(str(second), fmi_type=kind, stop_time=1.0, output_interval=0.1)
    arrays = fmpy.simulate_fmu(str(fmu), fmi_type=kind, stop_time=1.0, output_interval=0.1)
    for k in range(3):
        assert np.array_equal(arrays["y"][:, k], scalars[f"y[{k + 1}]"])


def test_all_states_are_counted(fmu: Path, tmp_path: Path) -> None:
    with running(fmu, tmp_path, FMU3Model) as (model, _, _):
        assert model.getNumberOfContinuousStates() == 2
