"""FMI 3.0 FMUs: valid, the trajectories of the FMI 2.0 ones to the last bit, and bad calls refused."""

import ctypes
import math
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException  # type: ignore[import-untyped]
from fmpy.fmi3 import FMU3Model, FMU3Slave  # type: ignore[import-untyped]
from helpers_fmi3 import derivative, size
from helpers_systems import integrator, lag, oscillator, pendulum

from fmus.archive import extract_fmu
from fmus.catalogue import find_modelica_model
from fmus.errors import FmuError
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem
from fmus.validate import validate_fmu

SYSTEMS: dict[str, Callable[[], SymbolicSystem]] = {
    "lag": lag,
    "oscillator": oscillator,
    "pendulum": pendulum,
    "integrator": integrator,
    "muscle": lambda: find_modelica_model("muscle").compile(),
}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {name: build_fmu(make(), folder / f"{name}.fmi3.fmu", fmi_version="3.0") for name, make in SYSTEMS.items()}


@contextmanager
def instance(fmu: Path, folder: Path, kind: type = FMU3Slave) -> Iterator[tuple[FMU3Slave, dict[str, int], list[str]]]:
    """An instance, its value references and its messages."""
    extract_fmu(fmu, folder)
    description = fmpy.read_model_description(str(folder))
    identifier = description.coSimulation.modelIdentifier
    messages: list[str] = []
    slave = kind(
        instanceName="slave",
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier=identifier,
    )
    slave.instantiate(logMessage=lambda *args: messages.append(args[3].decode()))
    yield slave, {v.name: v.valueReference for v in description.modelVariables}, messages
    slave.fmi3FreeInstance(slave.component)


def started(slave: FMU3Slave) -> FMU3Slave:
    slave.enterInitializationMode(tolerance=1e-8)
    slave.exitInitializationMode()
    return slave


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_built_fmu_has_no_findings(fmus: dict[str, Path], name: str) -> None:
    assert validate_fmu(fmus[name]) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_both_versions_give_the_same_bits(fmus: dict[str, Path], name: str, kind: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]()
    second = build_fmu(system, tmp_path / "second.fmu")
    table = np.zeros(4, dtype=[(n, float) for n in ("time", *(v.name for v in system.inputs))])
    table["time"] = [0.0, 0.3, 0.3, 1.0]
    for variable in system.inputs:
        table[variable.name] = [0.01, 0.02, 0.04, 0.05]
    results = [
        fmpy.simulate_fmu(
            str(fmu), fmi_type=kind, stop_time=1.0, output_interval=0.02, input=table if system.inputs else None
        )
        for fmu in (fmus[name], second)
    ]

    for output in system.outputs:
        assert np.array_equal(results[0][output], results[1][output])
        assert np.isfinite(results[0][output]).all()


def test_directional_derivatives_are_those_of_the_equations(fmus: dict[str, Path], tmp_path: Path) -> None:
    with instance(fmus["oscillator"], tmp_path / "o") as (slave, vr, _):
        started(slave)
        unknowns, knowns = [vr["der(v)"], vr["q"]], [vr["q"], vr["v"], vr["u"]]
        assert slave.getDirectionalDerivative(unknowns, knowns, [1.0, 2.0, 3.0]) == pytest.approx(
            [-9.0 - 2 * 0.1 * 3.0 * 2.0 + 3.0, 1.0]
        )


@pytest.mark.parametrize("running", [False, True])
@pytest.mark.parametrize("name", SYSTEMS)
def test_adjoint_derivatives_are_the_transpose(fmus: dict[str, Path], tmp_path: Path, name: str, running: bool) -> None:
    random = np.random.default_rng(4)
    with instance(fmus[name], tmp_path / name) as (slave, _, _):
        slave.enterInitializationMode()
        if running:
            slave.exitInitializationMode()
            slave.doStep(0.0, 0.01)
        variables = fmpy.read_model_description(str(fmus[name])).modelVariables
        states = [v.derivative for v in variables if v.derivative is not None]
        knowns = [v for v in variables if v.causality in ("input", "parameter")] + states
        unknowns = [v for v in variables if v.causality in ("output", "local", "calculatedParameter")]
        seed = random.normal(size=sum(map(size, knowns)))
        weights = random.normal(size=sum(map(size, unknowns)))
        rows, columns = [v.valueReference for v in unknowns], [v.valueReference for v in knowns]
        forward = derivative(slave, "fmi3GetDirectionalDerivative", rows, columns, seed, len(weights))
        reverse = derivative(slave, "fmi3GetAdjointDerivative", rows, columns, weights, len(seed))

    assert np.dot(weights, forward) == pytest.approx(np.dot(reverse, seed), rel=1e-9)


@pytest.mark.parametrize("kind", [FMU3Slave, FMU3Model])
def test_a_state_survives_as_bytes(fmus: dict[str, Path], tmp_path: Path, kind: type) -> None:
    with instance(fmus["lag"], tmp_path / "lag", kind) as (slave, vr, messages):
        started(slave)
        slave.setFloat64([vr["u"]], [1.0])
        state = slave.getFMUState()
        content = slave.serializeFMUState(state)
        slave.setFloat64([vr["u"]], [2.0])
        slave.freeFMUState(state)
        copy = slave.deserializeFMUState(content)
        slave.setFMUState(copy)
        slave.freeFMUState(copy)
        assert slave.getFloat64([vr["u"]]) == [1.0]
        with pytest.raises(FMICallException):
            slave.deserializeFMUState(content[:-1])
        assert "do not fit a state of this model" in messages[-1]


def test_a_jump_leaves_the_delay_as_an_event(fmus: dict[str, Path], tmp_path: Path) -> None:
    with instance(fmus["lag"], tmp_path / "lag", FMU3Model) as (model, vr, _):
        started(model)
        assert (model.getNumberOfContinuousStates(), model.getNumberOfEventIndicators()) == (1, 0)
        assert model.updateDiscreteStates() == (False, False, False, False, False, math.inf)
        model.setFloat64([vr["u"]], [1.0])
        *_, defined, upcoming = model.updateDiscreteStates()
        assert (defined, upcoming) == (True, pytest.approx(0.1))
        model.enterContinuousTimeMode()
        model.setTime(0.1)
        assert model.completedIntegratorStep() == (False, False)
        assert model.getFloat64([vr["late"]]) == [0.0]
        model.enterEventMode()
        model.updateDiscreteStates()
        assert model.getFloat64([vr["late"]]) == [1.0]


def test_bad_calls_are_refused_with_a_message(fmus: dict[str, Path], tmp_path: Path) -> None:
    with instance(fmus["lag"], tmp_path / "lag") as (slave, vr, messages):
        calls: list[Callable[[], object]] = [
            lambda: slave.doStep(0.0, 0.1),
            lambda: slave.getFloat64([vr["x"]]),
            lambda: started(slave).doStep(0.0, -0.1),
            lambda: slave.setFloat64([vr["u"]], [math.nan]),
            lambda: slave.setFloat64([vr["u"]], [1.0, 2.0]),
            lambda: slave.getInt32([vr["u"]]),
            lambda: slave.getClock([vr["u"]]),
            lambda: slave.enterEventMode(),
            lambda: slave.enterConfigurationMode(),
            lambda: slave.getOutputDerivatives([vr["x"]], [1]),
            lambda: slave.setDebugLogging(True, ["all"]),
        ]
        for call in calls:
            with pytest.raises(FMICallException):
                call()
        assert messages == [
            "fmi3DoStep: not allowed while the FMU is instantiated",
            "fmi3GetFloat64: not allowed while the FMU is instantiated",
            "fmi3DoStep: step size -0.1 s at t = 0 s; it must be positive",
            "fmi3SetFloat64: 'u' = nan is not a finite number",
            "fmi3SetFloat64: 2 values for variables with 1 elements",
            "fmi3GetInt32: value reference 0 is of type Float64",
            "fmi3GetClock: value reference 0 is of type Float64",
            "fmi3EnterEventMode: not allowed while the FMU is stepping",
            "fmi3EnterConfigurationMode: this FMU has no structural parameters",
            "fmi3GetOutputDerivatives: not provided by this FMU",
            "fmi3SetDebugLogging: category 'all' is unknown; there are logEvents, logStatusDiscard, logStatusError and "
            "logAll",
        ]
        slave.doStep(0.0, 0.1)


def test_what_cannot_be_had_gives_no_instance(fmus: dict[str, Path], tmp_path: Path) -> None:
    with instance(fmus["lag"], tmp_path / "lag") as (slave, _, _):
        messages: list[str] = []
        with pytest.raises(Exception, match="Failed to instantiate"):
            slave.instantiate(eventModeUsed=True, logMessage=lambda *args: messages.append(args[3].decode()))
        slave.guid = "{0}"
        with pytest.raises(Exception, match="Failed to instantiate"):
            slave.instantiate(logMessage=lambda *args: messages.append(args[3].decode()))
        assert messages[0] == "fmi3InstantiateCoSimulation: this FMU has no event mode in co-simulation"
        assert messages[1].startswith("fmi3InstantiateCoSimulation: the instantiation token is not that of this FMU, {")
        for function in ("fmi3Reset", "fmi3Terminate", "fmi3ExitInitializationMode"):
            assert getattr(ctypes.CDLL(slave.dll._name), function)(None) == 3
        with instance(fmus["lag"], tmp_path / "again"):
            pass  # a fresh one can still be made


def test_description_names_units_and_dependencies(fmus: dict[str, Path]) -> None:
    description = fmpy.read_model_description(str(fmus["lag"]))
    assert (description.fmiVersion, len(description.buildConfigurations)) == ("3.0", 1)
    by_name = {v.name: v for v in description.modelVariables}
    assert (by_name["x"].type, by_name["x"].unit, by_name["x"].nominal) == ("Float64", "N.m", "2.0")
    assert by_name["der(x)"].derivative is by_name["x"]
    unknowns = [*description.outputs, *description.derivatives]
    assert {u.variable.name: {v.name for v in u.dependencies} for u in unknowns} == {
        "x": {"x"},
        "late": {"u"},
        "der(x)": {"x", "u"},
    }


def test_the_sources_in_the_archive_compile_on_their_own(fmus: dict[str, Path], tmp_path: Path) -> None:
    extract_fmu(fmus["lag"], tmp_path)
    (file_set,) = fmpy.read_model_description(str(fmus["lag"])).buildConfigurations[0].sourceFileSets
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused", "-fsyntax-only"]
    subprocess.run([*command, *file_set.sourceFiles], cwd=tmp_path / "sources", check=True)
    assert not any(name.startswith("fmi2") for name in file_set.sourceFiles)


def test_an_unknown_version_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match=r"FMI version '1\.0' cannot be built; choose 2\.0 or 3\.0"):
        build_fmu(pendulum(), tmp_path / "p.fmu", fmi_version="1.0")
