"""A fit ends where the likelihood is greatest: parameters, forces and what a sensor does, all of them wrong at first."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.evidence import all_candidates, case_of, nominal_set
from orchestrator.greybox.fit import Work
from orchestrator.greybox.laws import laws
from orchestrator.greybox.search import FittedSet, Search, begun, fit_set
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements

SWING = """model Swing "A mass on a rod"
  parameter Real m(unit="kg")=0.2, l(unit="m")=0.15, g(unit="m/s2")=9.81;
  output Real q(unit="rad", start=0);
  Real w(unit="rad/s", start=0);
equation
  der(q) = w;
  m*l^2*der(w) = -m*g*l*sin(q);
end Swing;
"""
CASE = """files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]
learning = [1, 2]
held_out = [3]
[columns]
time = "s"
q = "rad"
[initial_conditions]
given = false
"""
SHORTER, DRAG, LATE, NOISE = 0.018, 3e-5, 8e-3, 1e-4
STEP, COUNT = 4e-3, 1000


@pytest.fixture(scope="module")
def search(tmp_path_factory: pytest.TempPathFactory) -> Search:
    folder, random = tmp_path_factory.mktemp("swing"), np.random.default_rng(8)
    (folder / "Swing.mo").write_text(SWING)
    (folder / "case.toml").write_text(CASE)
    length, inertia = 0.15 * (1 - SHORTER), 0.2 * 0.15**2
    times = STEP * np.arange(COUNT)
    for trial, start in ((1, 1.6), (2, 1.1), (3, 1.4)):
        run = solve_ivp(
            lambda t, x: [
                x[1],
                -9.81 / length * np.sin(x[0]) - DRAG / inertia * x[1] * abs(x[1]),
                (x[0] - x[2]) / LATE,
            ],
            (0.0, 0.5 + times[-1]),  # the sensor follows before the record begins
            [start, 0.0, start],
            t_eval=0.5 + times,
            rtol=1e-10,
            atol=1e-12,
        )
        shown = run.y[2] + NOISE * random.standard_normal(COUNT)
        rows = np.column_stack([times, shown])
        np.savetxt(folder / f"trial_{trial}.csv", rows, delimiter=",", header="time,q", comments="", fmt="%.9g")
    case = case_of(ModelicaModel("Swing", "Swing", folder / "Swing.mo"), load_measurements(str(folder)))
    limits = Thresholds()
    setting, nominal = nominal_set(case, limits)
    return Search(setting, all_candidates(case, nominal, laws()), nominal, lambda message: None)


def _first(search: Search, effect: str, site: str) -> Candidate:
    return next(c for c in search.candidates if (c.id, c.place.site) == (effect, site))


def _search_for(folder: Path, text: str, table: np.ndarray, output: str, unit: str, learning_s: float) -> Search:
    """A search on one record, columns time, a voltage that is held and an output, of which the first seconds are learned from."""
    name = text.split()[1]
    (folder / f"{name}.mo").write_text(text)
    np.savetxt(folder / "run.csv", table, delimiter=",", header=f"time,u,{output}", comments="", fmt="%.9g")
    (folder / "case.toml").write_text(
        f'files = ["run.csv"]\nlearning_window_s = [0.0, {learning_s}]\nheld_out_window_s = [{learning_s}, {int(table[-1, 0]) + 0.9}]\n'
        f'[columns]\ntime = "s"\nu = "V"\n{output} = "{unit}"\n[interpolation]\nu = "hold"\n'
    )
    case = case_of(ModelicaModel(name, name, folder / f"{name}.mo"), load_measurements(str(folder)))
    setting, nominal = nominal_set(case, Thresholds())
    return Search(setting, all_candidates(case, nominal, laws()), nominal, lambda message: None)


def test_a_wrong_length_drag_and_a_late_sensor_are_found_together_and_nothing_disturbs_them(search: Search) -> None:
    wanted = ("parameter_error", "l"), ("quadratic_drag", "q"), ("sensor_lag", "sensor:q")
    found = search.fit(tuple(_first(search, *each) for each in wanted))
    assert found is not None
    wrong, drag, late = found.candidates
    assert found.value(wrong, "share")[0] == pytest.approx(-SHORTER, rel=0.01)
    assert found.value(drag, "c")[0] == pytest.approx(DRAG * (1 - SHORTER) ** 2, rel=0.05)
    assert found.value(late, "T")[0] == pytest.approx(LATE, rel=0.02)
    # A free swing says little of the share that is late, so long as nobody knows what the sensor held at first: the fit is at the end.
    fit = found.fit
    whole = Work(fit.box, fit.trials, fit.priors).value(np.array([-SHORTER, *fit.theta[1:2], 1.0, LATE]), fit.noise)
    assert -fit.log_likelihood <= whole
    # Forces so small that over a second they turn it by less than the sensor's noise.
    inertia = 0.2 * 0.15**2
    assert all(own.intensity[0] / inertia < NOISE for own in found.fit.noise)


def test_a_set_with_one_effect_more_is_no_less_likely_than_the_one_it_extends(search: Search) -> None:
    pair = (_first(search, "parameter_error", "l"), _first(search, "sensor_lag", "sensor:q"))
    less = search.fit(pair)
    assert less is not None
    more = search.fit((*less.candidates, _first(search, "quadratic_drag", "q")))
    assert more is not None
    assert more.losses.sum() <= less.losses.sum() + 1e-6


MOTOR = """model Motor "A motor with a coarse tachometer"
  parameter Real k(unit="N.m/A")=0.0044, R(unit="Ohm")=50, J(unit="kg.m2")=4.7e-8;
  input Real u(unit="V");
  output Real w(unit="rad/s", start=0);
equation
  J*der(w) = k*(u - k*w)/R;
end Motor;
"""
COARSE, JITTER, LOST, RATE = 22.0, 11.0, 0.7, 50


def test_a_fit_finds_how_coarse_a_sensor_is_whatever_noise_it_begins_with(tmp_path: Path) -> None:
    """The model as given leaves forces by which the speed follows any reading, so that its sensor seems to be without noise."""
    random = np.random.default_rng(4)
    times = np.arange(60 * RATE) / RATE
    u = np.repeat(random.uniform(2.5, 4.5, 30), 2 * RATE)
    w, rows = 0.0, []
    for volts in u:
        rows.append(COARSE * np.round((w + JITTER * random.standard_normal()) / COARSE))
        settled = (volts - LOST) / 0.0044
        w = settled + (w - settled) * np.exp(-(0.0044**2) / 50 / 4.7e-8 / RATE)
    table = np.column_stack([times, u, rows])
    search = _search_for(tmp_path, MOTOR, table, "w", "rad/s", 40.0)
    setting, nominal = search.setting, search.nominal
    lost = (_first(search, "constant_force", "w"),)
    other, found = fit_set(setting, lost, nominal.fit.noise), fit_set(setting, lost, None)
    assert other.loss == pytest.approx(found.loss, abs=0.5)
    assert found.fit.noise[0].sensors[0] == pytest.approx(np.hypot(COARSE / np.sqrt(12), JITTER), rel=0.1)


FAN = """model Fan "A pendulum that a fan lifts"
  parameter Real m(unit="kg")=0.005, l(unit="m")=0.0545, g(unit="m/s2")=9.81, K(unit="N/V")=0.0136;
  input Real u(unit="V");
  output Real q(unit="rad", start=0);
  Real w(unit="rad/s", start=0);
equation
  der(q) = w;
  m*l^2*der(w) = K*u*l - m*g*l*sin(q);
end Fan;
"""
LOSS, STICK, SMOOTH = 8e-6, 6e-5, 0.05


def test_dry_friction_is_fitted_alike_however_sharp_it_is_at_first_and_by_steps_that_are_short_enough(
    tmp_path: Path,
) -> None:
    random = np.random.default_rng(6)
    step, inertia = 0.01, 0.005 * 0.0545**2
    u = np.repeat(random.uniform(0.0, 3.2, 16), 100)
    q, w, rows = 0.0, 0.0, []
    for volts in u:
        rows.append(np.round(q / 1e-3) * 1e-3)
        for _ in range(20):
            lost = LOSS * w + STICK * np.tanh(w / SMOOTH)
            w += step / 20 * (0.0136 * volts * 0.0545 - 0.005 * 9.81 * 0.0545 * np.sin(q) - lost) / inertia
            q += step / 20 * w
    table = np.column_stack([step * np.arange(len(u)), u, rows])
    search = _search_for(tmp_path, FAN, table, "q", "rad", 12.0)
    setting, nominal = search.setting, search.nominal
    friction, loss = _first(search, "coulomb_friction", "q"), _first(search, "viscous_friction", "q")
    likelihoods = []
    for sharp in (0.005, 0.05, 0.5):
        found = fit_set(setting, (friction.begun_with({"vSharp": sharp}), loss), nominal.fit.noise)
        fit = found.fit
        assert found.value(friction, "fC")[0] == pytest.approx(STICK, rel=0.05)
        likelihoods.append(fit.log_likelihood)
        finer = [t.in_steps(2 * t.parts) for t in fit.trials]
        shorter = Work(fit.box, finer, fit.priors).value(fit.theta, fit.noise)
        assert abs(shorter + fit.log_likelihood) < 1.0
    assert max(likelihoods) - min(likelihoods) < 6.0  # the priors of three first values differ by this much


def test_a_fit_left_far_behind_the_best_set_is_ended_before_a_decision_uses_it(search: Search) -> None:
    wanted = ("parameter_error", "l"), ("quadratic_drag", "q"), ("sensor_lag", "sensor:q")
    best = search.fit(tuple(_first(search, *each) for each in wanted))
    alone = (_first(search, "sensor_lag", "sensor:q"),)
    whole = fit_set(search.setting, alone, search.nominal.fit.noise)
    assert best is not None and whole.loss > best.loss + 500
    first = min(begun(search.setting, alone, search.nominal.fit.noise), key=lambda each: each.loss)
    left = search.setting.fitter.end(first.fit, rival=-best.fit.log_likelihood)
    assert not left.ended
    search.fitted[first.key] = FittedSet(alone, left)
    ended = search.fit(alone)
    assert ended is not None and ended.fit.ended
    assert ended.loss < whole.loss + 1


def test_the_likeliest_of_sets_that_have_begun_are_ended_and_one_far_behind_them_is_left(search: Search) -> None:
    every = Search(search.setting, search.candidates, search.nominal, lambda message: None)
    wrong, drag, late = (
        _first(search, *each)
        for each in (("parameter_error", "l"), ("quadratic_drag", "q"), ("sensor_lag", "sensor:q"))
    )
    every._fit_all([(wrong, drag, late), (wrong, drag), (late,)])
    fits = {len(key): found for key, found in every.fitted.items()}
    assert fits[3].fit.ended
    assert every.best is fits[3]
    assert not fits[1].fit.ended
    assert fits[1].loss > fits[3].loss + 30
