"""What a model keeps from event to event is read off a record, and effects are found at its balances."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import misfit
from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError
from orchestrator.blackbox.of_class import class_model
from orchestrator.blackbox.source import FmuSource
from orchestrator.compare.comparison import compare
from orchestrator.diagnose import diagnose
from orchestrator.discover import discover
from orchestrator.greybox.evidence import case_of
from orchestrator.greybox.kept import event_inputs, event_parameters
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_source
from orchestrator.verdicts.result import Estimate, NamedEffect

ROOM = """model Room "A room whose heater is switched by a two-point controller"
  parameter Real C(unit="J/K") = 4e5;
  parameter Real G(unit="W/K") = 60;
  parameter Real P(unit="W") = 3500;
  parameter Real low(unit="K") = 290;
  parameter Real high(unit="K") = 296;
  input Real Tout(unit="K");
  output Real T(unit="K", start=293.5, fixed=true);
  Boolean on(start=true, fixed=true);
equation
  when T > high then
    on = false;
  elsewhen T < low then
    on = true;
  end when;
  C*der(T) = (if on then P else 0) - G*(T - Tout);
end Room;
"""

FURNACE = """model Furnace "A furnace with a sampled PI controller"
  parameter Real C(unit="J/K") = 900;
  parameter Real G(unit="W/K") = 1.2;
  parameter Real Kp(unit="W/K") = 20;
  parameter Real Ti(unit="s") = 200;
  input Real Tset(unit="K");
  output Real T(unit="K", start=293.15, fixed=true);
  discrete Real I(unit="W", start=0, fixed=true);
  discrete Real u(unit="W", start=0, fixed=true);
equation
  when sample(0, 5) then
    I = pre(I) + Kp/Ti*5*(Tset - T);
    u = min(3000, max(0, Kp*(Tset - T) + pre(I)));
  end when;
  C*der(T) = u - G*(T - 293.15);
end Furnace;
"""

BALL = """model Ball
  parameter Real m(unit="kg") = 1;
  input Real f(unit="N");
  output Real h(unit="m", start=1, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
equation
  der(h) = v; der(v) = f/m - 9.81;
  when h < 0 then reinit(v, -0.8*pre(v)); end when;
end Ball;
"""


def write(folder: Path, text: str, columns: str, trials: list[np.ndarray]) -> tuple[str, Path]:
    name = text.split()[1]
    (folder / f"{name}.mo").write_text(text)
    data = folder / "data"
    data.mkdir()
    for k, rows in enumerate(trials):
        np.savetxt(data / f"{k}.csv", rows, delimiter=",", header=columns, comments="", fmt="%.9g")
    return f"{folder / name}.mo:{name}", data


def room(folder: Path, draught: float, noise: float, switches: list[float] | None = None) -> tuple[str, Path]:
    """Records whose switches, in the last one at these times, are found by SciPy between samples; the draught loses heat to 288 K."""
    random, trials, switches = np.random.default_rng(3), [], [] if switches is None else switches
    time = 60.0 * np.arange(400)
    for _ in range(3):
        outside = np.interp(time, np.linspace(0, time[-1], 9), random.uniform(268, 285, 9))
        T, on, now, shown = 293.5, True, 0.0, [293.5]
        switches.clear()
        for end in time[1:]:
            while now < end:

                def rate(t: float, y: np.ndarray, on: bool = on, outside: np.ndarray = outside) -> np.ndarray:
                    lost = 60 * (y - np.interp(t, time, outside)) + draught * (y - 288)
                    return ((3500 if on else 0) - lost) / 4e5

                def reached(t: float, y: np.ndarray, on: bool = on) -> float:
                    return float(y[0]) - (296 if on else 290)

                reached.terminal, reached.direction = True, 1 if on else -1  # type: ignore[attr-defined]
                run = solve_ivp(rate, (now, end), [T], events=reached, rtol=1e-9, atol=1e-9)
                T, now = float(run.y[0, -1]), float(run.t[-1])
                if run.status == 1:
                    on = not on
                    switches.append(now)
            shown.append(T)
        readings = np.array(shown) + noise * random.standard_normal(len(time))
        trials.append(np.column_stack([time, outside, readings]))
    return write(folder, ROOM, "time [s],Tout [K],T [K]", trials)


def furnace(folder: Path, loss: float, noise: float) -> tuple[str, Path]:
    """Records by the exponential that holds between ticks; each tick reads the set point of its instant."""
    random, trials = np.random.default_rng(4), []
    for _ in range(3):
        T, summed, u, rows = 293.15, 0.0, 0.0, []
        wanted = np.repeat(random.uniform(400, 900, 5), 120)
        for k, setting in enumerate(wanted):
            if k % 5 == 0:
                u = min(3000.0, max(0.0, 20 * (setting - T) + summed))
                summed += 20 / 200 * 5 * (setting - T)
            rows.append((k, setting, T + noise * random.standard_normal()))
            end = 293.15 + u / (1.2 + loss)
            T = end + (T - end) * math.exp(-(1.2 + loss) / 900)
        trials.append(np.array(rows))
    return write(folder, FURNACE, "time [s],Tset [K],T [K]", trials)


def test_switches_of_a_thermostat_are_read_off_the_record_where_they_were(tmp_path: Path) -> None:
    """No sample is beyond a threshold: the room is at it for an instant between two of them."""
    true: list[float] = []
    model, data = room(tmp_path, 0.0, 1e-6, true)
    case = case_of(find_modelica_model(model), load_measurements(data))
    assert case.recorded is not None
    trial, plain = case.data.trials[-1], case.recorded.trials[-1]
    added = ~np.isin(trial.time, plain.time)
    assert np.isnan(trial.outputs[added]).all() and np.isfinite(trial.outputs[~added]).all()
    heats = trial.inputs[:, [v.name for v in case.base.inputs].index("pre(on)")]
    found = trial.time[1:][np.diff(heats) != 0]
    assert len(found) == len(true) > 10
    assert np.abs(found - np.array(true)).max() < 1.0


def test_commands_of_a_sampled_controller_are_read_off_the_record(tmp_path: Path) -> None:
    model, data = furnace(tmp_path, 0.0, 1e-6)
    case = case_of(find_modelica_model(model), load_measurements(data))
    trial = case.data.trials[0]
    assert "Tset" in event_inputs(case.base) and {"Kp", "Ti"} <= set(event_parameters(case.base))
    command = trial.inputs[:, [v.name for v in case.base.inputs].index("pre(u)")]
    T, setting = trial.outputs[:, 0], trial.inputs[:, 0]
    assert np.allclose(np.diff(trial.time), 1.0)  # ticks come at samples
    assert np.all(np.diff(command)[np.arange(1, len(command)) % 5 != 0] == 0)
    first = min(3000.0, 20 * (setting[0] - T[0]))
    assert command[0] == pytest.approx(first, rel=1e-4)


def test_a_draught_is_found_in_a_room_whose_heater_is_switched(tmp_path: Path) -> None:
    model, data = room(tmp_path, 25.0, 0.01)
    source, measured = find_modelica_model(model), load_measurements(data)
    found = discover(source, measured, tmp_path / "out", workers=1, laws=False)
    [effect] = found.diagnosis.effects
    assert (effect.id, effect.site) == ("heat_loss", "T")
    lost = effect.parameters["G"].value * 293 - effect.parameters["f0"].value
    assert lost == pytest.approx(25 * 5, rel=0.1)
    errors = [entry.held_out.over_floor for entry in found.entries]
    assert errors[0] > 100 and errors[1] < 2
    # What was written switches by itself.
    assert compare(class_model(found.versions[0].source), measured).learning.over_floor < 2


def test_a_threshold_that_only_a_switch_knows_is_found_to_be_wrong(tmp_path: Path) -> None:
    model, data = room(tmp_path, 0.0, 0.01)
    source = find_modelica_model(model)
    assert source.file is not None
    source.file.write_text(ROOM.replace("= 296;", "= 297;"))
    found = diagnose(source, load_measurements(data), workers=1)
    assert [(e.id, e.site) for e in found.effects] == [("parameter_error", "high")]
    share = found.effects[0].parameters["share"]
    assert share.value == pytest.approx(296 / 297 - 1, rel=0.02)
    assert found.steps[0].comparison.held_out.over_floor > 50 and found.steps[-1].comparison.held_out.over_floor < 2


def test_a_furnace_that_loses_more_is_told_from_its_controller(tmp_path: Path) -> None:
    model, data = furnace(tmp_path, 0.5, 0.3)
    found = diagnose(find_modelica_model(model), load_measurements(data), workers=1)
    assert [(e.id, e.site) for e in found.effects] == [("heat_loss", "T")]
    assert found.effects[0].parameters["G"].value == pytest.approx(0.5, rel=0.02)
    assert found.steps[-1].comparison.held_out.over_floor < 1.2


@pytest.mark.parametrize("make", [room, furnace])
def test_nothing_is_missing_where_events_explain_all(make: object, tmp_path: Path) -> None:
    model, data = make(tmp_path, 0.0, 0.01)  # type: ignore[operator]
    found = diagnose(find_modelica_model(model), load_measurements(data), workers=1)
    assert found.verdict == "adequate"


def test_more_events_than_samples_are_refused(tmp_path: Path) -> None:
    model, data = furnace(tmp_path, 0.0, 0.1)
    quick = find_modelica_model(model)
    assert quick.file is not None
    quick.file.write_text(FURNACE.replace("sample(0, 5)", "sample(0, 0.05)"))
    with pytest.raises(ComponentError, match="more than 3 events between samples"):
        case_of(quick, load_measurements(data))
    found = diagnose(quick, load_measurements(data), workers=1)
    assert found.verdict == "cannot_tell" and any("events between samples" in note for note in found.warnings)
    # So such a model is looked at from outside.
    assert isinstance(load_source(model, load_measurements(data)), FmuSource)


def test_the_notebook_takes_models_with_events_and_adds_to_them_without_data(tmp_path: Path) -> None:
    for text in (ROOM, BALL):
        (tmp_path / f"{text.split()[1]}.mo").write_text(text)
        assert misfit.Model(f"{tmp_path}/{text.split()[1]}.mo:{text.split()[1]}").outputs
    lost = NamedEffect("heat_loss", "T", {"G": Estimate(5.0, "W/K", (5.0, 5.0)), "f0": Estimate(0.0, "W", (0.0, 0.0))})
    better = misfit.Model(f"{tmp_path}/Room.mo:Room").add([lost])
    assert "T" in better.outputs


def test_a_loss_is_written_beside_a_controller_that_reads_its_own_past(tmp_path: Path) -> None:
    """As the on-off controller of the Modelica Standard Library: an equation with `pre`, and no `when`."""
    equation = "on = pre(on) and T < high or T < low;"
    begin, end = ROOM.index("  when"), ROOM.index("end when;") + len("end when;")
    (tmp_path / "Room.mo").write_text(f"{ROOM[:begin]}  {equation}{ROOM[end:]}")
    lost = NamedEffect("heat_loss", "T", {"G": Estimate(5.0, "W/K", (5.0, 5.0)), "f0": Estimate(0.0, "W", (0.0, 0.0))})
    better = misfit.Model(f"{tmp_path}/Room.mo:Room").add([lost])
    better.to_modelica(tmp_path / "Better.mo")
    assert "- heat1_G*T" in (tmp_path / "Better.mo").read_text()


def test_a_model_whose_states_jump_is_diagnosed_as_an_fmu(tmp_path: Path) -> None:
    time = np.arange(0, 0.4, 0.01)
    trial = np.column_stack([time, 0 * time, 1 - 4.905 * time**2])
    model, data = write(tmp_path, BALL, "time [s],f [N],h [m]", [trial, trial])
    assert isinstance(load_source(model, load_measurements(data)), FmuSource)
