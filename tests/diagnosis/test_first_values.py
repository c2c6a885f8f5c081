"""Where fits begin: at the best of several starts, and with levels inside the range of the record."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, fit_nominal, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.fit.start_values import StartValues
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.search.ranges_of_levels import with_ranges_of_levels
from orchestrator.diagnosis.search.screening import Explanation, Screened, Screener
from orchestrator.library.cards import SHIPPED, Candidate, effect_library, read_card
from orchestrator.models.smoothing import SmoothedTrial

TIME = np.arange(0, 5, 0.01)
NOISE = np.array([1e-3])


def candidates(base: ModelicaModel, *ids: str) -> list[Candidate]:
    cards = [card for card in effect_library() if card.id in ids]
    return find_candidates(base, base.compile(), cards)[0]


def test_fit_takes_the_start_from_which_free_runs_are_nearest() -> None:
    """Between 25 and 6 waves of cogging a turn lie others that fit worse than both: no descent leads across."""
    pendulum, true = find_modelica_model("pendulum"), [5e-3, 0.0, 6.0]
    effects = EffectSet(pendulum, candidates(pendulum, "cogging"), ["theta"])
    model = effects.model
    nothing = np.zeros((len(TIME), len(model.inputs)))
    theta = model.compiled.run(TIME, nothing, model.compiled.with_values(true), np.array([np.pi + 1.0, 0.0])).outputs
    measured = theta + NOISE * np.random.default_rng(1).standard_normal(theta.shape)
    learning = LearningData((SmoothedTrial(TIME, nothing, measured, NOISE),), NOISE)
    far, near = [1e-3, 1e-3, 25.0], [1e-3, 1e-3, 6.3]

    lost, found = refit(effects, learning, np.array(far)), refit(effects, learning, np.array([far, near]))

    assert found.cost < 1.3
    assert abs(found.values[2] - 6.0) < 4 * found.std[2]
    assert lost.cost > found.cost + 5 * (2 / found.fit.rows) ** 0.5  # five standard deviations of what noise does to it


def test_first_value_that_is_small_against_its_typical_size_is_not_taken_for_its_bound() -> None:
    """A drag of 4 nN.m.s2 shows on a swinging pendulum; with its typical size, 10 mN.m.s2, none swings, and fits get nowhere."""
    pendulum, drag = find_modelica_model("pendulum"), 4e-9
    effects = EffectSet(pendulum, candidates(pendulum, "quadratic_drag"), ["theta"])
    model, noise = effects.model, np.array([1e-5])
    nothing, start = np.zeros((len(TIME), len(model.inputs))), np.array([0.5, 0.0])
    theta = model.compiled.run(TIME, nothing, model.compiled.with_values([drag]), start, substeps=8).outputs
    measured = theta + noise * np.random.default_rng(1).standard_normal(theta.shape)

    found = refit(
        effects, LearningData((SmoothedTrial(TIME, nothing, measured, noise),), noise), np.array([0.5 * drag])
    )

    assert found.cost < 1.0 + 5 * (2 / found.fit.rows) ** 0.5
    assert found.values[0] == pytest.approx(drag, abs=5 * found.std[0])


def test_fit_may_begin_where_an_earlier_one_does_when_the_record_hardly_shows_its_start() -> None:
    """A speed that is off by 0.02 rad/s turns a drive by five periods of a wave too far: rightly sized waves look wrong."""
    drive, true, begins = find_modelica_model("drive"), np.array([3e-3, 0.0, 25.0]), np.array([0.0, -1.2])
    effects = EffectSet(drive, candidates(drive, "cogging"), ["phi"])
    model, time, noise = effects.model, np.arange(0, 10, 0.02), np.array([3e-3])
    inputs = np.column_stack([0.02 * np.sin(0.8 * time), np.zeros(len(time))])
    phi = model.compiled.run(time, inputs, model.compiled.with_values(true), begins).outputs
    measured = phi + noise * np.random.default_rng(1).standard_normal(phi.shape)
    learning = LearningData((SmoothedTrial(time, inputs, measured, noise),), noise)
    rows = np.array([true - [0, 0, 0.1], [6e-4, 0.0, 6.0]])
    near = StartValues(tuple(state.name for state in model.system.states), (begins,), 0.0)

    lost, found = refit(effects, learning, rows), refit(effects, learning, rows, near=near)

    assert found.cost < 1.0 + 2 * (2 / found.fit.rows) ** 0.5 < 1.5 < lost.cost
    assert abs(found.values[2] - 25.0) < 4 * found.std[2]


def test_states_of_which_an_earlier_fit_knows_nothing_begin_as_the_record_shows() -> None:
    drive = find_modelica_model("drive")
    model = EffectSet(drive, candidates(drive, "sensor_lag"), ["phi"]).model
    inputs = np.zeros((len(TIME), len(model.inputs)))
    trial = SmoothedTrial(TIME, inputs, 0.3 + 0.1 * TIME[:, None], NOISE)
    guess = np.array([0.05])
    shown = model.record(trial, model.compiled.with_values(guess)).start
    names = [state.name for state in model.system.states]

    begun = StartValues(("w", "of another effect"), (np.array([-7.0, 5.0]),), 0.001).in_model(model, guess, [trial])

    assert len(names) == 3 and begun.shift == 0.001
    for name, value, known in zip(names, begun.starts[0], shown, strict=True):
        assert value == (-7.0 if name == "w" else known)


def test_levels_beyond_which_effects_act_start_within_the_range_of_the_record() -> None:
    drive = find_modelica_model("drive")
    chosen = candidates(drive, "saturation", "end_stop")
    torque = 0.1 * np.sin(2 * np.pi * 0.5 * TIME)
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    effects = EffectSet(drive, (), ["phi"])
    model = effects.model
    phi = model.compiled.run(TIME, inputs, model.compiled.parameters, np.zeros(2)).outputs
    learning = LearningData((SmoothedTrial(TIME, inputs, phi, NOISE),), NOISE)
    base = fit_nominal(effects, model, learning)

    found = with_ranges_of_levels(chosen, Response(base, [t.smoother for t in learning.trials]))

    grids = {
        f"{c.card.id} {c.card.variant}": np.array(p.grid) for c in found for p in c.card.parameters if len(p.grid) > 0
    }
    assert set(grids) == {"saturation drive", "end_stop above", "end_stop below"}
    assert np.all((grids["saturation drive"] > 0) & (grids["saturation drive"] < 0.1))
    middle = np.median(phi)
    assert np.all((grids["end_stop above"] > middle) & (grids["end_stop above"] < phi.max()))
    assert np.all((grids["end_stop below"] < middle) & (grids["end_stop below"] > phi.min()))


def swinging(start: float, effect: str = "end_stop") -> list[Candidate]:
    """The end stops, or another effect, of a pendulum let go at an angle, with what its motion says of their levels."""
    pendulum = find_modelica_model("pendulum")
    effects = EffectSet(pendulum, (), ["theta"])
    model = effects.model
    nothing = np.zeros((len(TIME), len(model.inputs)))
    theta = model.compiled.run(TIME, nothing, model.compiled.parameters, np.array([start, 0.0])).outputs
    learning = LearningData((SmoothedTrial(TIME, nothing, theta, NOISE),), NOISE)
    base = fit_nominal(effects, model, learning)
    return list(
        with_ranges_of_levels(candidates(pendulum, effect), Response(base, [t.smoother for t in learning.trials]))
    )


def test_end_stops_of_a_hanging_pole_lie_where_it_swings_and_not_far_from_there() -> None:
    """It swings from 2.14 to 4.14 rad about pi. A stop at 200 rad is a constant torque in disguise."""
    for candidate in swinging(np.pi + 1.0):
        effects = EffectSet(find_modelica_model("pendulum"), [candidate], ["theta"])
        low, high = effects.bounds()
        level = [p.name for p in effects.card_parameters].index("qStop")

        assert all(2.1 < angle < 4.2 for angle in effects.card_parameters[level].grid)
        assert low[level] == pytest.approx(np.pi - 1.5, abs=0.02)
        assert high[level] == pytest.approx(np.pi + 1.5, abs=0.02)


@pytest.mark.parametrize(("amplitude", "apart"), [(0.05, 4.0), (1.0, np.pi / 2.0), (2.5, np.pi / 5.0)])
def test_waves_of_cogging_are_scanned_as_finely_as_they_get_out_of_step(amplitude: float, apart: float) -> None:
    """Over 5 rad, 24 waves a turn are more than half a wave out of step with 24.7: no descent leads from one to the other."""
    (cogging,) = swinging(np.pi + amplitude, "cogging")
    grid = next(np.array(p.grid) for p in cogging.card.parameters if p.name == "periods")

    assert (grid[0], grid[-1]) == (3.0, 48.0)
    assert 0.5 * apart < np.diff(grid).max() <= apart * 1.01


def test_waves_over_what_a_card_does_not_need_are_refused(tmp_path: Path) -> None:
    text = (SHIPPED / "cogging.toml").read_text()
    (tmp_path / "cogging.toml").write_text(text.replace('waves_over = "q"', 'waves_over = "w"'))

    with pytest.raises(
        MisfitError, match=r"'waves_over' = 'w', expected the variable of one of the card's \[\[needs\]\]: q"
    ):
        read_card(tmp_path / "cogging.toml")


@pytest.mark.parametrize("grid", ["", "grid = []", "grid = [5]", "grid = [5, 5]", "grid = [5, 9, 5]"])
def test_waves_without_a_grid_that_ascends_are_refused(tmp_path: Path, grid: str) -> None:
    text = (SHIPPED / "cogging.toml").read_text()
    (tmp_path / "cogging.toml").write_text(re.sub(r"grid = \[.*\]", grid, text))

    with pytest.raises(MisfitError, match="two or more numbers of waves that ascend"):
        read_card(tmp_path / "cogging.toml")


def test_where_nothing_moves_an_end_stop_may_be_anywhere() -> None:
    assert all(np.isinf([p.low, p.high]).all() for c in swinging(np.pi) for p in c.card.parameters)


def test_bounds_of_a_class_hold_where_a_record_was_beyond_them() -> None:
    """A stop of at most 1000 rad on a drive that has turned by 2000 rad."""
    drive = find_modelica_model("drive")
    stop = candidates(drive, "end_stop")[0]
    far = [replace(p, low=1900.0, high=2100.0) if p.name == "qStop" else p for p in stop.card.parameters]
    moved = replace(stop, card=replace(stop.card, parameters=tuple(far)))

    np.testing.assert_equal(EffectSet(drive, [moved], ["phi"]).bounds(), EffectSet(drive, [stop], ["phi"]).bounds())


def screened_tremor(amplitude: float, frequency: float, torque: np.ndarray, scale: float) -> Screened:
    """What screening says of a tremor in three trials of a drive, a phase in each, whose encoder reads `scale` times too much."""
    drive = find_modelica_model("drive")
    (tremor,) = [c for c in candidates(drive, "tremor")]
    model, nominal = EffectSet(drive, [tremor], ["phi"]).model, EffectSet(drive, (), ["phi"]).model
    names = [v.name.split(".")[-1] for v in model.system.states]
    inputs, trials = np.zeros((len(TIME), len(model.inputs))), []
    inputs[:, [v.name for v in model.inputs].index("torque")] = torque
    for k, phase in enumerate((0.4, 2.5, 4.6)):
        start = np.zeros(len(names))
        start[names.index("phase[1]")], start[names.index("phase[2]")] = np.sin(phase), np.cos(phase)
        parameters = model.compiled.with_values([amplitude, frequency])
        phi = scale * model.compiled.run(TIME, inputs, parameters, start).outputs
        noise = 1e-5 * np.random.default_rng(k).standard_normal(phi.shape)
        kept = slice(len(TIME) - 30 * k)  # no two trials are as long
        trials.append(SmoothedTrial(TIME[kept], inputs[kept], (phi + noise)[kept], np.array([1e-5])))
    learning = LearningData(tuple(trials), np.array([1e-5]))
    return Screener(drive, nominal, learning).explain([tremor])[0].screened


def test_an_effect_whose_screening_failed_beside_a_fitted_set_is_left_to_free_runs() -> None:
    drive = find_modelica_model("drive")
    nominal, (friction,) = EffectSet(drive, (), ["phi"]), candidates(drive, "viscous_friction")
    still = np.zeros((len(TIME), len(nominal.model.inputs)))
    learning = LearningData(
        (SmoothedTrial(TIME, still, 1e-3 * TIME[:, None] ** 2, np.array([1e-5])),), np.array([1e-5])
    )
    unscreened = Explanation(Screened((friction,), np.array([0.1]), np.nan), np.zeros((0, 0)), False)
    current: Any = SimpleNamespace(effects=nominal, values=np.zeros(0))

    (found,) = Screener(drive, nominal.model, learning).extend(current, [(friction, unscreened)])

    assert np.isnan(found.gain)
    assert found.values.tolist() == [0.1]


def test_a_tremor_far_smaller_than_its_first_guess_is_found_with_another_phase_in_each_trial() -> None:
    """The guess is 0.05 N.m, and only the product of an amplitude and a phase's length shows."""
    found = screened_tremor(amplitude=1e-3, frequency=4.7, torque=np.zeros(len(TIME)), scale=1.0)

    assert found.gain > 0.9
    assert abs(found.values[0]) == pytest.approx(1e-3, rel=0.05)
    assert found.values[1] == pytest.approx(4.7, abs=0.01)


def test_a_tremor_beside_a_larger_error_at_the_frequency_of_the_command_is_a_further_start() -> None:
    torque = 0.03 * np.sin(2 * np.pi * 2.0 * TIME)
    found = screened_tremor(amplitude=1e-3, frequency=4.7, torque=torque, scale=1.05)

    assert found.values[1] == pytest.approx(2.0, abs=0.05)
    (other,) = found.others
    assert abs(other[0]) == pytest.approx(1e-3, rel=0.2)
    assert other[1] == pytest.approx(4.7, abs=0.02)
