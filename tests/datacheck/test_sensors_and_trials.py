"""Stuck and saturated sensors, single wrong trials, clocks that do not agree."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from orchestrator.datacheck.check import check_data, mend
from orchestrator.datacheck.findings import Finding
from orchestrator.datacheck.prediction import Predictor
from orchestrator.measurements import bind, load_measurements
from orchestrator.model_argument import load_model
from tests.datacheck.records import drive, rubbing_slide, write_case
from tests.thinned import thinned

Columns = dict[str, np.ndarray]
UNITS = {"torque": "N.m", "phi": "rad"}
STEP = 0.01


def slightly_braked(seed: int) -> Columns:
    return drive(seed, friction=0.005)


def found_in(folder: Path, spoil: Callable[[Columns, int], Columns], trials: int = 5) -> tuple[Finding, ...]:
    write_case(folder, slightly_braked, UNITS, spoil, trials)
    return check_data(load_model("drive"), load_measurements(folder))


def later(columns: Columns, seconds: float) -> Columns:
    return {**columns, "torque": np.interp(columns["time"] - seconds, columns["time"], columns["torque"])}


def test_a_sensor_that_sticks_is_named_with_its_seconds_and_cut(tmp_path: Path) -> None:
    def spoil(columns: Columns, number: int) -> Columns:
        phi = columns["phi"].copy()
        if number == 2:
            phi[100:160] = phi[100]
        return {**columns, "phi": phi}

    (finding,) = found_in(tmp_path, spoil)
    assert (finding.kind, finding.column, finding.trial, finding.strong) == ("stuck", "phi", "trial_2.csv", True)
    assert finding.keep == pytest.approx((1.60, 3.99))
    again = mend(load_model("drive"), load_measurements(tmp_path))
    assert again.open == ()
    assert again.measurements.trials[1].time[0] == pytest.approx(1.60)


def test_a_sensor_that_saturates_is_named_with_all_its_trials(tmp_path: Path) -> None:
    def spoil(columns: Columns, number: int) -> Columns:
        low, high = np.quantile(columns["phi"], [0.1, 0.9])
        return {**columns, "phi": np.clip(columns["phi"], low, high)}

    found = found_in(tmp_path, spoil)
    assert found[0].strong
    assert {finding.kind for finding in found} == {"saturated"}


def test_a_machine_at_rest_is_no_stuck_sensor(tmp_path: Path) -> None:
    """A drive that coasts to rest under a torque too small to move it, and an encoder with a digit of 1e-3 rad."""

    def stopped(seed: int) -> Columns:
        time = STEP * np.arange(400)
        phi = np.where(time < 2.0, 1.0 - 0.25 * np.clip(2.0 - time, 0, None) ** 2, 1.0)
        return {"time": time, "torque": 1e-3 * np.sin(9 * time), "phi": np.round(phi, 3)}

    write_case(tmp_path, stopped, UNITS)
    found = check_data(load_model("drive"), load_measurements(tmp_path))
    assert "stuck" not in {finding.kind for finding in found}


def test_one_trial_in_degrees_is_named_alone(tmp_path: Path) -> None:
    def spoil(columns: Columns, number: int) -> Columns:
        return {**columns, "phi": columns["phi"] * (180 / math.pi if number == 3 else 1.0)}

    (finding,) = found_in(tmp_path, spoil)
    assert (finding.kind, finding.trial, finding.strong) == ("unit", "trial_3.csv", True)
    assert mend(load_model("drive"), load_measurements(tmp_path)).open == ()


def test_outputs_that_answer_before_their_inputs_are_a_clock_and_late_ones_may_be_the_plant(tmp_path: Path) -> None:
    (early,) = found_in(tmp_path / "early", lambda columns, number: later(columns, 8 * STEP), 3)
    assert (early.kind, early.strong) == ("delay", True)
    assert early.change is not None
    assert early.change.value == pytest.approx(-8 * STEP, abs=STEP)
    (late,) = found_in(tmp_path / "late", lambda columns, number: later(columns, -8 * STEP), 3)
    assert (late.kind, late.strong) == ("delay", False)
    assert mend(load_model("drive"), load_measurements(tmp_path / "late")).done == ()


@pytest.mark.parametrize("samples", [5.8, 6.7, 8.3])
def test_a_delay_is_told_by_its_own_time_and_not_by_whole_samples(tmp_path: Path, samples: float) -> None:
    (late,) = found_in(tmp_path, lambda columns, number: later(columns, -samples * STEP), 3)
    assert late.change is not None
    assert late.change.value == pytest.approx(samples * STEP, abs=0.15 * STEP)


SLIDE = """model Slide
  input Real F(unit = "N");
  output Real x(unit = "m");
  parameter Real m(unit = "kg") = 2, d(unit = "N.s/m") = 0.4, k(unit = "N/m") = 20;
  Real v(unit = "m/s");
equation
  der(x) = v;
  m*der(v) = F - d*v - k*x;
end Slide;
"""


def test_dry_friction_at_one_frequency_is_no_wrong_clock_and_a_clock_beside_it_is_one(tmp_path: Path) -> None:
    """Friction makes the motion at one frequency lead the model's, by the same time in every trial; read by pushes, it does not.

    An FMU cannot be pushed: there only a model that is as good as the noise with inputs moved says that it is the clock.
    """
    (tmp_path / "Slide.mo").write_text(SLIDE)
    model, units = load_model(f"{tmp_path}/Slide.mo:Slide"), {"F": "N", "x": "m"}
    rubs = load_measurements(write_case(tmp_path / "rubs", rubbing_slide, units))
    assert not [finding for finding in check_data(model, rubs) if finding.strong]
    early = load_measurements(write_case(tmp_path / "early", lambda n: rubbing_slide(n, 0.0, 0.06), units))
    (finding,) = check_data(model, early)
    assert finding.strong and finding.change is not None
    assert finding.change.value == pytest.approx(-0.06, abs=0.01)
    for record, is_clock in ((rubs, False), (early, True)):
        data = bind(record, model.inputs, model.outputs)
        reached = Predictor(model, data, data.learning).reaches_noise(finding.change)
        assert reached is is_clock


def test_one_file_whose_clocks_differ_from_the_others_is_named(tmp_path: Path) -> None:
    (finding,) = found_in(tmp_path, lambda columns, number: later(columns, -8 * STEP if number == 2 else 0.0))
    assert (finding.kind, finding.trial, finding.strong) == ("delay", "trial_2.csv", True)


def test_a_lag_that_not_every_trial_shows_clearly_is_no_clock_of_single_trials(tmp_path: Path) -> None:
    """Muscles that answer late are physics, which forces that the model lacks may stand for: no trial's clock is called wrong."""
    case = thinned(Path(__file__).parents[1] / "cases" / "arm" / "case_008", tmp_path, 2)
    found = check_data(load_model("arm"), load_measurements(case))
    assert not [finding for finding in found if finding.trial or finding.strong]


@pytest.mark.parametrize("tau", [0.03, 0.05, 0.08])
def test_a_sensor_that_is_late_in_every_trial_is_no_clock_of_the_trial_that_shows_it_best(
    tmp_path: Path, tau: float
) -> None:
    def spoil(columns: Columns, number: int) -> Columns:
        kept, phi = math.exp(-STEP / tau), columns["phi"]
        late = lfilter([1 - kept], [1, -kept], phi, zi=[kept * phi[0]])[0]
        return {**columns, "phi": late + 1e-4 * np.random.default_rng(number).normal(size=len(phi))}

    assert found_in(tmp_path, spoil) == ()


def test_held_out_trials_forbid_nothing(tmp_path: Path) -> None:
    def spoil(columns: Columns, number: int) -> Columns:
        return {**columns, "phi": columns["phi"] * (180 / math.pi if number == 5 else 1.0)}

    (finding,) = found_in(tmp_path, spoil)
    assert (finding.trial, finding.strong) == ("trial_5.csv", False)
