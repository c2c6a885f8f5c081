"""Model exchange: the same trajectories as co-simulation, and a delay record kept at completed steps."""

import math
from collections.abc import Callable
from ctypes import byref, c_double, c_int, c_size_t
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from fmpy.fmi2 import fmi2EventInfo  # type: ignore[import-untyped]
from helpers_slave import DISCARD, ERROR, MODEL_EXCHANGE, Slave
from helpers_systems import integrator, lag, oscillator, pendulum, root

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem

SYSTEMS: dict[str, Callable[[], SymbolicSystem]] = {
    "lag": lag,
    "oscillator": oscillator,
    "pendulum": pendulum,
    "integrator": integrator,
    "root": root,
    "arm": lambda: find_modelica_model("arm").compile(),
}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {name: build_fmu(make(), folder / f"{name}.fmu") for name, make in SYSTEMS.items()}


def pulses(system: SymbolicSystem) -> np.ndarray | None:
    """Inputs that jump at 0.25 s and 0.4 s, marked as jumps by repeated times."""
    names = [v.name for v in system.inputs]
    if not names:
        return None
    table = np.zeros(6, dtype=[(name, float) for name in ("time", *names)])
    table["time"] = [0.0, 0.25, 0.25, 0.4, 0.4, 1.0]
    for column, name in enumerate(names):
        table[name] = np.repeat([0.0, 0.3 / (column + 1), 0.1], 2)
    return table


@pytest.mark.parametrize("name", [name for name in SYSTEMS if name != "root"])
def test_model_exchange_gives_the_trajectory_of_co_simulation(fmus: dict[str, Path], name: str) -> None:
    system = SYSTEMS[name]()
    one, other = (
        fmpy.simulate_fmu(
            str(fmus[name]),
            fmi_type=kind,
            stop_time=1.0,
            output_interval=0.01,
            relative_tolerance=1e-8,
            input=pulses(system),
            record_events=False,
        )
        for kind in ("CoSimulation", "ModelExchange")
    )

    for output in system.outputs:
        # CVODE's global error is some hundred times its tolerance per step.
        assert np.abs(one[output] - other[output]).max() < 1e-6 * max(1.0, np.abs(one[output]).max())


class Exchanged(Slave):
    """A model-exchange instance in continuous-time mode at t = 0 s."""

    def __init__(self, fmu: Path, folder: Path, **values: float) -> None:
        super().__init__(fmu, folder, MODEL_EXCHANGE)
        self.start(**values)
        self.next_event = self.update()
        self.insist("fmi2EnterContinuousTimeMode")

    def update(self) -> float | None:
        info = fmi2EventInfo()
        self.insist("fmi2NewDiscreteStates", byref(info))
        return info.nextEventTime if info.nextEventTimeDefined else None

    def at(self, time: float, **inputs: float) -> None:
        self.insist("fmi2SetTime", c_double(time))
        self.set(**inputs)

    def complete(self) -> None:
        event, end = c_int(1), c_int(1)
        self.insist("fmi2CompletedIntegratorStep", 1, byref(event), byref(end))
        assert (event.value, end.value) == (0, 0)

    def jump(self, **inputs: float) -> float | None:
        """An event in which inputs jump; the time of the next event."""
        self.insist("fmi2EnterEventMode")
        self.set(**inputs)
        upcoming = self.update()
        self.insist("fmi2EnterContinuousTimeMode")
        return upcoming


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.1, 0.25])
def test_a_delayed_ramp_is_exact_within_and_after_a_step(fmus: dict[str, Path], tmp_path: Path, delay: float) -> None:
    with Exchanged(fmus["lag"], tmp_path / "lag", T=delay) as slave:
        for end in (0.1, 0.2, 0.35, 0.5):
            for time in (end - 0.02, end + 0.05, end):  # trials, one of them taken back
                slave.at(time, u=2.0 * time)
                assert slave.get("late") == pytest.approx(2.0 * max(0.0, time - delay), abs=1e-12)
            slave.complete()


def test_a_jump_leaves_the_delay_as_an_event(fmus: dict[str, Path], tmp_path: Path) -> None:
    with Exchanged(fmus["lag"], tmp_path / "lag", T=0.1) as slave:
        assert slave.next_event is None
        slave.at(0.05)
        slave.complete()
        assert slave.jump(u=1.0) == pytest.approx(0.15, abs=1e-12)
        slave.at(0.15)
        slave.complete()
        assert slave.get("late") == 0.0  # the step ends on the left of the jump
        assert slave.jump() is None
        assert slave.get("late") == 1.0


def test_a_rejected_step_leaves_no_trace_in_the_record(fmus: dict[str, Path], tmp_path: Path) -> None:
    with Exchanged(fmus["lag"], tmp_path / "lag", T=0.1) as slave:
        slave.at(0.1, u=5.0)
        slave.complete()
        slave.at(0.05, u=0.0)  # the importer went back and completes a shorter step
        slave.complete()
        slave.at(0.15)
        slave.complete()
        slave.at(0.2)
        assert slave.get("late") == 0.0


def test_states_and_derivatives_come_as_arrays(fmus: dict[str, Path], tmp_path: Path) -> None:
    two = c_double * 2
    with Exchanged(fmus["oscillator"], tmp_path / "o") as slave:
        states, derivatives, nominals = two(), two(), two()
        slave.insist("fmi2GetContinuousStates", states, c_size_t(2))
        assert list(states) == [0.5, 0.0]
        slave.insist("fmi2SetContinuousStates", two(0.1, 0.2), c_size_t(2))
        slave.insist("fmi2GetDerivatives", derivatives, c_size_t(2))
        assert list(derivatives) == pytest.approx([0.2, -2 * 0.1 * 3 * 0.2 - 9 * 0.1])
        slave.insist("fmi2GetNominalsOfContinuousStates", nominals, c_size_t(2))
        assert list(nominals) == [1.0, 1.0]
        slave.insist("fmi2GetEventIndicators", None, c_size_t(0))


def test_bad_calls_are_refused(fmus: dict[str, Path], tmp_path: Path) -> None:
    two = c_double * 2
    with Exchanged(fmus["oscillator"], tmp_path / "o") as slave:
        assert slave.call("fmi2DoStep", c_double(0.0), c_double(0.1), 1) == ERROR
        assert slave.call("fmi2NewDiscreteStates", byref(fmi2EventInfo())) == ERROR
        assert slave.call("fmi2SetContinuousStates", two(), c_size_t(1)) == ERROR
        assert slave.call("fmi2SetContinuousStates", two(0.0, math.inf), c_size_t(2)) == ERROR
        assert slave.call("fmi2SetTime", c_double(math.nan)) == ERROR
        assert slave.messages == [
            "fmi2DoStep: not allowed while the FMU is in continuous-time mode",
            "fmi2NewDiscreteStates: not allowed while the FMU is in continuous-time mode",
            "fmi2SetContinuousStates: 1 values for 2 states",
            "fmi2SetContinuousStates: 'v' = inf is not a finite number",
            "fmi2SetTime: time nan s is not a finite number",
        ]
    with Exchanged(fmus["root"], tmp_path / "root") as slave:
        slave.insist("fmi2SetContinuousStates", byref(c_double(-1.0)), c_size_t(1))
        assert slave.call("fmi2GetDerivatives", byref(c_double()), c_size_t(1)) == DISCARD
        assert "der(x) = " in slave.messages[0]


def test_a_state_continues_in_its_own_interface_type_only(fmus: dict[str, Path], tmp_path: Path) -> None:
    with (
        Exchanged(fmus["lag"], tmp_path / "lag", T=0.1) as exchanged,
        Slave(fmus["lag"], tmp_path / "lag").start() as stepping,
    ):
        exchanged.at(0.05, u=1.0)
        exchanged.complete()
        saved = exchanged.save()
        exchanged.at(0.3, u=0.0)
        exchanged.complete()
        exchanged.insist("fmi2SetFMUstate", saved)
        exchanged.at(0.125)
        assert exchanged.get("late") == pytest.approx(0.5)
        assert stepping.call("fmi2SetFMUstate", saved) == ERROR
        assert stepping.call("fmi2SetFMUstate", stepping.from_bytes(exchanged.to_bytes(saved))) == ERROR
        assert stepping.messages == [
            "fmi2SetFMUstate: the pointer is not a state of this instance, or one that was freed",
            "fmi2SetFMUstate: the state is one of model exchange, this instance is not",
        ]
        exchanged.insist("fmi2FreeFMUstate", byref(saved))


def test_both_interfaces_declare_what_they_can(fmus: dict[str, Path]) -> None:
    with_delay, without = (fmpy.read_model_description(str(fmus[name])).modelExchange for name in ("lag", "pendulum"))
    assert with_delay.providesDirectionalDerivative
    assert with_delay.canGetAndSetFMUstate
    assert (with_delay.needsCompletedIntegratorStep, without.needsCompletedIntegratorStep) == (True, False)
