"""Events of relations: located exactly, alike in both interfaces, and part of the state of an instance."""

import math
from collections.abc import Callable
from ctypes import byref, c_double, c_size_t
from dataclasses import dataclass
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from fmpy.fmi2 import fmi2EventInfo  # type: ignore[import-untyped]
from fmpy.fmi3 import FMU3Slave  # type: ignore[import-untyped]
from fmpy.validation import validate_fmu  # type: ignore[import-untyped]
from helpers_relations import contact, pulse, relay, sliding, tank, undecided
from helpers_slave import ERROR, MODEL_EXCHANGE, Slave

from fmus.archive import extract_fmu
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem

SYSTEMS: dict[str, Callable[[], SymbolicSystem]] = {
    "tank": tank,
    "contact": contact,
    "relay": relay,
    "sliding": sliding,
    "pulse": pulse,
    "undecided": undecided,
}


@dataclass(frozen=True)
class Fmus:
    folder: Path

    def __call__(self, name: str, version: str = "2.0") -> Path:
        path = self.folder / f"{name}-{version}.fmu"
        if not path.exists():
            build_fmu(SYSTEMS[name](), path, fmi_version=version, tolerance=1e-10)
        return path


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Fmus:
    return Fmus(tmp_path_factory.mktemp("fmus"))


def simulated(fmu: Path, kind: str, **options: object) -> np.ndarray:
    result: np.ndarray = fmpy.simulate_fmu(
        str(fmu),
        fmi_type=kind,
        stop_time=3.0,
        output_interval=0.1,
        relative_tolerance=1e-10,
        record_events=False,
        **options,
    )
    return result


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(("kind", "limit"), [("CoSimulation", 1e-9), ("ModelExchange", 1e-8)])
def test_a_filling_tank_follows_its_closed_form(fmus: Fmus, version: str, kind: str, limit: float) -> None:
    result = simulated(fmus("tank", version), kind)
    t = result["time"]
    level = np.where(t <= 1, t, 2 - np.exp(-2 * (t - 1)))
    assert np.abs(result["z1"] - level).max() < limit  # CVODE's global error is above its tolerance per step


@pytest.mark.parametrize("step", [0.003, 0.1, 1.5])
def test_bouncing_on_a_stiff_spring_keeps_the_energy(fmus: Fmus, tmp_path: Path, step: float) -> None:
    with Slave(fmus("contact"), tmp_path / "contact").start(1e-12) as slave:
        for _ in range(round(3.0 / step)):
            slave.step(step)
        assert slave.get("z1") == pytest.approx(10.0, rel=1e-9)
        # Half a swing on the spring lasts contact s, a free flight the time of rise and fall; both from the energy.
        omega, speed = 100.0, math.sqrt(20.0)
        under = 2 * (math.pi - math.atan(omega * speed / 10)) / omega
        phase = (3.0 - speed / 10) % (under + 2 * speed / 10) - under
        assert phase > 0.0
        assert slave.get("x1") == pytest.approx(speed * phase - 5 * phase**2, abs=1e-8)


def test_an_input_ramp_switches_a_relay_at_its_zero(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("relay"), tmp_path / "relay").start(u1=1.0) as slave:
        slave.slope(u1=-3.0)
        slave.step(1.0)
        assert slave.get("x1") == pytest.approx(1 / 3 - 0.5 * 2 / 3, abs=1e-12)


def test_an_input_jump_counts_at_the_communication_point(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("relay"), tmp_path / "relay").start(u1=1.0) as slave:
        slave.step(0.5)
        slave.set(u1=-1.0)
        assert slave.get("der(x1)") == -0.5
        slave.step(0.5)
        assert slave.get("x1") == pytest.approx(0.5 - 0.25, abs=1e-12)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_a_short_pulse_in_time_is_not_stepped_over(fmus: Fmus, version: str, kind: str) -> None:
    fmu = fmus("pulse", version)
    last = [
        simulated(fmu, kind, start_values={"p1": at}, output=["x1"])["x1"][-1] for at in (0.05, 1.0, 2.95, 2.9995, 7.0)
    ]
    assert last == pytest.approx([1e-3, 1e-3, 1e-3, 0.5e-3, 0.0], abs=1e-12)


def test_a_relation_has_its_new_side_at_the_very_time(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("pulse"), tmp_path / "pulse").start(p1=1.0) as slave:
        slave.step(1.0)
        assert slave.get("z1") == 1.0
        slave.step(1e-3)
        assert slave.get("z1") == 0.0
        assert slave.get("x1") == pytest.approx(1e-3, abs=1e-15)


def test_sliding_along_a_relation_is_an_error_that_names_it(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("sliding"), tmp_path / "sliding").start() as slave:
        slave.step(0.4)
        assert slave.call("fmi2DoStep", c_double(0.4), c_double(0.4), 1) == ERROR
        assert slave.messages == [
            "fmi2DoStep: the relation relation 1 changes over and over at t = 0.5 s; the model slides along it"
        ]
        assert slave.get("x1") == pytest.approx(0.1, abs=1e-12)  # as before the step


def test_a_relation_without_a_side_is_an_error_that_names_it(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("undecided"), tmp_path / "undecided") as slave:
        slave.insist("fmi2EnterInitializationMode")
        assert slave.call("fmi2ExitInitializationMode") == ERROR
        assert "relation 1 has no consistent side at t = 0 s" in slave.messages[0]


def test_a_restored_run_passes_its_events_again_with_the_same_bits(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("contact"), tmp_path / "contact").start() as slave:
        for _ in range(46):  # 0.46 s: on the spring
            slave.step(0.01)
        assert slave.get("x1") < 0.0
        state, time = slave.save(), slave.time
        copy = slave.from_bytes(slave.to_bytes(state))
        runs = []
        for kept in (None, state, copy):
            if kept is not None:
                slave.insist("fmi2SetFMUstate", kept)
                slave.insist("fmi2FreeFMUstate", byref(kept))
                slave.time = time
            values = []
            for _ in range(100):
                slave.step(0.02)
                values.append((slave.get("x1"), slave.get("z1")))
            runs.append(values)
    assert runs[0] == runs[1] == runs[2]


def test_in_model_exchange_relations_keep_their_side_until_an_event(fmus: Fmus, tmp_path: Path) -> None:
    one = c_size_t(1)
    with Slave(fmus("tank"), tmp_path / "tank", MODEL_EXCHANGE).start() as slave:
        info, indicator, derivative = fmi2EventInfo(), c_double(), c_double()
        slave.insist("fmi2NewDiscreteStates", byref(info))
        assert not info.nextEventTimeDefined
        slave.insist("fmi2EnterContinuousTimeMode")
        for level, sign in ((0.5, 1), (1.0 + 1e-9, -1)):
            slave.insist("fmi2SetContinuousStates", byref(c_double(level)), one)
            slave.insist("fmi2GetEventIndicators", byref(indicator), one)
            assert math.copysign(1, indicator.value) == sign
            slave.insist("fmi2GetDerivatives", byref(derivative), one)
            assert derivative.value == 1.0
        assert slave.directional(["der(x1)"], ["x1"], [1.0]) == [0.0]
        assert slave.directional(["eventIndicator_1"], ["x1"], [1.0]) == [-1.0]
        slave.insist("fmi2EnterEventMode")
        slave.insist("fmi2NewDiscreteStates", byref(info))
        slave.insist("fmi2EnterContinuousTimeMode")
        slave.insist("fmi2GetDerivatives", byref(derivative), one)
        assert derivative.value == pytest.approx(2.0)
        assert slave.directional(["der(x1)"], ["x1"], [1.0]) == [-2.0]


def test_a_time_event_is_announced_in_model_exchange(fmus: Fmus, tmp_path: Path) -> None:
    with Slave(fmus("pulse"), tmp_path / "pulse", MODEL_EXCHANGE).start(p1=0.25) as slave:
        announced = []
        for time in (0.0, 0.25, 0.251):
            if time > 0.0:
                slave.insist("fmi2EnterEventMode")
                slave.insist("fmi2SetTime", c_double(time))
            info = fmi2EventInfo()
            slave.insist("fmi2NewDiscreteStates", byref(info))
            announced.append((info.nextEventTimeDefined, info.nextEventTime, slave.get("z1")))
            slave.insist("fmi2EnterContinuousTimeMode")
    assert announced == [(1, 0.25, 0.0), (1, pytest.approx(0.251), 1.0), (0, 0.0, 0.0)]


def stepping(fmu: Path, folder: Path, *, event_mode: bool, early_return: bool) -> FMU3Slave:
    description = fmpy.read_model_description(str(fmu))
    slave = FMU3Slave(
        guid=description.guid,
        unzipDirectory=str(extract_fmu(fmu, folder)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="slave",
    )
    slave.instantiate(eventModeUsed=event_mode, earlyReturnAllowed=early_return)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave


def test_with_event_mode_a_step_ends_at_the_event(fmus: Fmus, tmp_path: Path) -> None:
    slave = stepping(fmus("tank", "3.0"), tmp_path / "tank", event_mode=True, early_return=True)
    try:
        assert slave.updateDiscreteStates()[0] is False
        slave.enterStepMode()
        assert slave.doStep(0.0, 0.4) == (False, False, False, 0.4)
        needed, _, early, reached = slave.doStep(0.4, 1.6)
        assert (needed, early) == (True, True)
        assert reached == pytest.approx(1.0, abs=1e-9)
        slave.enterEventMode()
        slave.updateDiscreteStates()
        slave.enterStepMode()
        assert slave.doStep(reached, 2.0 - reached) == (False, False, False, 2.0)
        references = [v.valueReference for v in fmpy.read_model_description(str(tmp_path / "tank")).modelVariables]
        assert slave.getFloat64(references[:1])[0] == pytest.approx(2 - math.exp(-2), abs=1e-9)
    finally:
        slave.freeInstance()


@pytest.mark.parametrize("event_mode", [True, False])
def test_without_early_return_events_stay_inside_the_step(fmus: Fmus, tmp_path: Path, event_mode: bool) -> None:
    slave = stepping(fmus("tank", "3.0"), tmp_path / "tank", event_mode=event_mode, early_return=not event_mode)
    try:
        if event_mode:
            slave.enterStepMode()
        assert slave.doStep(0.0, 2.0) == (False, False, False, 2.0)
        assert slave.getFloat64([0])[0] == pytest.approx(2 - math.exp(-2), abs=1e-9)
    finally:
        slave.freeInstance()


def test_event_indicators_are_declared(fmus: Fmus) -> None:
    second, third = (
        fmpy.read_model_description(str(fmus("tank", version)), validate=True) for version in ("2.0", "3.0")
    )
    assert second.numberOfEventIndicators == 1
    assert third.numberOfEventIndicators == 1
    assert third.coSimulation.hasEventMode
    assert [v.name for v in third.modelVariables if v.description == "Event of relation 1"] == ["eventIndicator_1"]
    assert not validate_fmu(str(fmus("tank", "3.0")))
