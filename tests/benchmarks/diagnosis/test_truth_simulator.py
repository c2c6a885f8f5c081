"""The truth simulator: against the models it shall judge, against MuJoCo, and against what physics demands."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.symbolic import SymbolicModel
from tests.benchmarks.diagnosis.scoring.sites import site_parts
from tests.benchmarks.diagnosis.truth.context import Context
from tests.benchmarks.diagnosis.truth.excitation import plan_trial
from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish, draw_case
from tests.benchmarks.diagnosis.truth.library import EFFECTS
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.native import has_mujoco, simulate, simulate_tanks
from tests.benchmarks.diagnosis.truth.nearest import beyond_smaller_sets, left_by_library
from tests.benchmarks.diagnosis.truth.run import Injection, run_trial
from tests.benchmarks.diagnosis.truth.sensors import Recorder
from tests.benchmarks.diagnosis.truth.signal_effects import slow_reading
from tests.benchmarks.diagnosis.truth.write import write_case
from tests.benchmarks.diagnosis.truth.yardstick import Yardstick

STILL = np.zeros((5001, 0))


@pytest.mark.parametrize("name", MACHINES)
def test_nominal_truth_and_nominal_model_move_alike(name: str) -> None:
    """Two derivations, two integrators: they differ by less than the finest encoder's noise, 1e-5."""
    machine = MACHINES[name]
    plan = plan_trial(machine, 0, 4.0, np.random.default_rng(3))
    run = run_trial(machine, plan)
    system = find_modelica_model(name).compile()
    model = CompiledModel(system, list(machine.outputs), [])
    places = [list(machine.inputs).index(v.name) if v.name in machine.inputs else None for v in system.inputs]
    u = np.column_stack([np.zeros(len(run.time)) if k is None else run.recorded[:, k] for k in places] or [STILL[:0]])
    order = list(machine.order)
    start = np.concatenate([run.q[0, order], run.v[0, order]]) if name != "tanks" else run.q[0]

    modelled = model.run(run.time, u.reshape(len(run.time), -1), model.parameters, start).outputs

    assert np.ptp(run.outputs, axis=0).min() > 1e-3
    np.testing.assert_allclose(run.outputs, modelled, atol=1e-5)


@pytest.mark.skipif(not has_mujoco(), reason="MuJoCo comes with the extra 'bench'")
@pytest.mark.parametrize("name", ["arm", "double-pendulum"])
def test_plain_linkage_moves_as_mujocos(name: str) -> None:
    machine = MACHINES[name]
    plan = plan_trial(machine, 0, 4.0, np.random.default_rng(5))
    more = {"mw": 0.2, "gx": 0.3, "gy": -9.0, "dw": 0.4, "c1": 0.05 * machine.torque}
    plain = run_trial(machine, plan, changed=more)

    mujoco = run_trial(machine, plan, changed=more, mujoco=True)

    np.testing.assert_allclose(plain.outputs, mujoco.outputs, atol=1e-9)


def test_pendulum_keeps_its_energy() -> None:
    p = MACHINES["pendulum"].values
    q, v = simulate("pendulum", p, STILL, [0.5], [0.0])
    inertia = p["I"] + p["m"] * p["a"] ** 2

    energy = 0.5 * inertia * v[:, 0] ** 2 + p["m"] * p["g"] * p["a"] * np.cos(q[:, 0])

    assert np.ptp(q) > 3
    assert np.ptp(energy) < 1e-9 * np.abs(energy).max() * 100


def test_double_pendulum_keeps_its_energy() -> None:
    p = MACHINES["double-pendulum"].values
    q, v = simulate("double-pendulum", p, STILL, [-0.9, 0.4], [0.0, 0.0])
    first = np.array([np.cos(q[:, 0]), np.sin(q[:, 0])]).T
    second = np.array([np.cos(q.sum(1)), np.sin(q.sum(1))]).T
    v1 = p["cm1"] * v[:, [0]] * first[:, ::-1] * [-1, 1]
    v2 = p["l1"] / p["cm1"] * v1 + p["cm2"] * v.sum(1, keepdims=True) * second[:, ::-1] * [-1, 1]
    height = p["m1"] * p["cm1"] * first[:, 1] + p["m2"] * (p["l1"] * first[:, 1] + p["cm2"] * second[:, 1])
    kinetic = 0.5 * (p["m1"] * (v1**2).sum(1) + p["m2"] * (v2**2).sum(1))
    kinetic += 0.5 * (p["I1"] * v[:, 0] ** 2 + p["I2"] * v.sum(1) ** 2)

    energy = kinetic - p["gy"] * height

    assert kinetic.max() > 0.1
    assert np.ptp(energy) < 1e-6


def test_coulomb_friction_stops_a_drive_where_and_when_it_must_and_holds_it() -> None:
    inertia, friction, speed, load = 0.02, 0.01, 1.5, 0.009
    u = np.zeros((6001, 1))
    u[4000:] = load

    q, v = simulate("drive", {"J": inertia, "c1": friction}, u, [0.0], [speed])

    assert q[3500, 0] == pytest.approx(inertia * speed**2 / (2 * friction), rel=1e-9)
    assert v[2999, 0] > 0
    assert np.all(v[3001:4000] == 0)
    assert np.all(q[3500:] == q[3500])


def test_stuck_joint_breaks_away_when_the_load_exceeds_breakaway_not_before() -> None:
    time = np.arange(3001) * 1e-3

    q, _ = simulate("drive", {"J": 0.02, "c1": 0.01, "s1": 0.01, "vs": 0.1}, 0.01 * time[:, None], [0.0], [0.0])

    moving = time[np.flatnonzero(q[:, 0] > 0)[0]]
    assert moving == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("friction", [1e-4, 0.05], ids=["slides", "sticks"])
def test_dry_friction_of_a_fast_machine_is_the_same_in_steps_that_are_four_times_finer(friction: float) -> None:
    """The small friction moves it by 0.03 rad; a speed rounded to none at each reversal was good for 0.013 rad of that."""
    values = {**MACHINES["two-mass"].values, "c1": friction, "c2": friction}
    time = np.arange(4001) * 1e-3
    u = (0.1 * np.cos(5 * time) + 0.2 * np.cos(30 * time) + 0.3 * np.cos(70 * time))[:, None]
    fine = np.interp(np.arange(16001) / 4, np.arange(4001), u[:, 0])[:, None]

    q, v = simulate("two-mass", values, u, [0.0, 0.0], [0.0, 0.0])
    finer, _ = simulate("two-mass", values, fine, [0.0, 0.0], [0.0, 0.0], step=2.5e-4)

    assert np.count_nonzero(np.diff(np.sign(v[:, 0]))) > 20
    np.testing.assert_allclose(q, finer[::4], atol=2e-6, rtol=0)


def test_play_is_the_same_in_steps_that_are_four_times_finer() -> None:
    values = {**MACHINES["two-mass"].values, "gap": 0.02, "b1": 0.02, "b2": 0.02}
    u = 0.02 * np.sin(2 * np.pi * np.arange(3001) * 1e-3)[:, None]
    fine = np.interp(np.arange(12001) / 4, np.arange(3001), u[:, 0])[:, None]

    q, _ = simulate("two-mass", values, u, [0.0, 0.0], [0.0, 0.0])
    finer, _ = simulate("two-mass", values, fine, [0.0, 0.0], [0.0, 0.0], step=2.5e-4)

    np.testing.assert_allclose(q, finer[::4], atol=1e-8)


def test_leaks_outlets_and_inflow_balance_the_content_of_the_tanks() -> None:
    values = {**MACHINES["tanks"].values, "leak1": 2e-6, "leak2": 3e-6, "clog": 0.4, "clogtime": 100.0}
    time = np.arange(2401) * 0.25
    inflow = 1e-4 * (1 + np.sin(time / 40))

    found = simulate_tanks(values, inflow, np.array([0.3, 0.2]), step=0.25)

    lost = np.sqrt(2 * values["g"] * found[:, :2]) @ [values["leak1"], values["leak2"]]
    content = found[:, :2] @ [values["A1"], values["A2"]]
    flows = inflow - lost - found[:, 2]
    gained = np.concatenate([[0.0], np.cumsum(0.125 * (flows[1:] + flows[:-1]))])
    assert np.ptp(content) > 1e-3
    np.testing.assert_allclose(content - content[0], gained, atol=1e-6)


def test_backlash_leaves_the_load_alone_until_the_play_is_used_up() -> None:
    values = {**MACHINES["two-mass"].values, "gap": 0.02}
    u = np.full((2001, 1), 1e-4)

    q, v = simulate("two-mass", values, u, [0.0, 0.0], [0.0, 0.0])

    alone = np.cumsum(q[:, 0] >= 0.01) == 0
    assert np.all(q[alone, 1] == 0)
    np.testing.assert_allclose(q[alone, 0], 0.5 * 1e-4 / 0.002 * (np.arange(2001)[alone] * 1e-3) ** 2, atol=1e-12)
    assert q[-1, 1] > 0


# What is shorter could be the recorder's clock, so these are sometimes larger against the noise than wanted.
LONGER_THAN_A_SAMPLE = {"stimulation_delay", "sensor_lag"}
# Tendons that are stiff enough to be hard to see are too stiff for the simulator.
SIZABLE = [(m, e) for m, library in EFFECTS.items() for e in library if e != "series_elasticity"]


@pytest.mark.parametrize(("machine", "effect"), SIZABLE)
def test_effect_reaches_the_wanted_size_against_the_noise(machine: str, effect: str) -> None:
    seconds = 1.0 if machine == "arm" else 2.0
    case = draw_case(Wish("S", machine, 0, 2, enr=5.0, noise="mid", seconds=seconds, effects=(effect,)))

    assert case.injections[0].id == effect
    assert case.enr_each[0] >= 5.0 * 0.85
    assert case.enr_each[0] <= 5.0 * 1.15 or effect in LONGER_THAN_A_SAMPLE


# The contract names it and the truth has it, but no slot of that model takes it.
NOT_OFFERED = {"constant_force"}


@pytest.mark.parametrize("machine", EFFECTS)
def test_truth_names_effects_sites_and_parameters_as_the_cards_do(machine: str) -> None:
    model = find_modelica_model(machine)
    candidates, _ = find_candidates(model, model.compile(), effect_library())
    context = _context(machine)

    for name, draw in EFFECTS[machine].items():
        for _ in range(4):  # sites are drawn
            true = draw(context)(1.0)
            own = [c for c in candidates if c.card.id == true.id]
            # Elements that share a card are fitted one at a time: each part of the truth's site is one of them.
            assert site_parts(true.site, machine) <= {p for c in own for p in site_parts(c.site, machine)} or (
                name in NOT_OFFERED and not own
            )
            known = {p.name for c in own for p in c.card.parameters}
            assert not own or {key.split("[")[0] for key in true.parameters} <= known


def _context(name: str) -> Context:
    machine, random = MACHINES[name], np.random.default_rng(1)
    plan = plan_trial(machine, 0, 2.0, random)
    return Context(machine, random, (run_trial(machine, plan),))


def test_nearest_library_effect_leaves_nothing_of_itself_and_most_of_what_it_cannot_imitate() -> None:
    case = draw_case(Wish("O", "pendulum", 0, 3, enr=10.0, noise="mid", seconds=2.0, effects=("warming_friction",)))
    runs = [run_trial(case.machine, plan) for plan in case.plans]
    random = np.random.default_rng(1)
    context = Context(case.machine, random, tuple(runs))
    yardstick = Yardstick.of(case.machine, case.plans, runs, case.recorder, random)
    viscous = {"viscous_friction": EFFECTS["pendulum"]["viscous_friction"]}
    scale = {"joint_scale": EFFECTS["pendulum"]["joint_scale"]}
    true = viscous["viscous_friction"](context)(0.01)

    size = yardstick.enr([true])

    assert left_by_library(context, viscous, true, yardstick) < 0.02 * size
    assert left_by_library(context, scale, true, yardstick) > 0.5 * size


def test_leak_and_outlet_error_are_one_at_one_tank_and_two_at_two() -> None:
    machine, random = MACHINES["tanks"], np.random.default_rng(9)
    plans = [plan_trial(machine, k, 10.0, random) for k in range(2)]
    runs = [run_trial(machine, plan) for plan in plans]
    yardstick = Yardstick.of(machine, plans, runs, Recorder.of(machine, "mid", runs), random)
    leaks = [Injection("leak", f"tank{k}", {}, {f"leak{k}": 2e-6}) for k in (1, 2)]
    narrow = Injection("outlet_error", "outlet2", {}, {"a2": 0.95 * machine.values["a2"]})

    assert min(yardstick.enr([each]) for each in (*leaks, narrow)) > 5.0
    assert beyond_smaller_sets([leaks[1], narrow], yardstick) < 0.1
    assert beyond_smaller_sets([leaks[0], narrow], yardstick) > 2.0


def test_a_leak_is_drawn_as_asked_however_small_and_never_beside_an_outlet_that_imitates_it() -> None:
    small = draw_case(Wish("S", "tanks", 0, 17001, enr=0.2, effects=("leak",)))
    pairs = [draw_case(Wish("D", "tanks", 0, seed, effects=("leak", "outlet_error"))) for seed in (14001, 17001)]

    assert [each.id for each in small.injections] == ["leak"]
    assert small.enr == pytest.approx(0.2, rel=0.1)
    for case in pairs:
        places = {each.id: each.site[-1] for each in case.injections}
        assert len(places) == 2
        assert places.get("leak") != places.get("outlet_error")


def test_a_set_is_drawn_anew_where_nothing_fits_beside_its_first_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    refused: list[Injection] = []

    def beyond(effects: list[Injection], _: Yardstick) -> float:
        refused.extend(effects[:1] if not refused else [])
        return 0.0 if effects[0] is refused[0] else 1.0

    monkeypatch.setattr("tests.benchmarks.diagnosis.truth.families.beyond_smaller_sets", beyond)
    case = draw_case(Wish("D", "pendulum", 0, 1, seconds=2.0))

    assert refused
    assert len(case.injections) == len(case.enr_each) == 2
    assert refused[0] not in case.injections


def test_force_sensor_reads_the_force_however_large_its_error_is_asked_to_be() -> None:
    gains = [
        EFFECTS["arm"]["force_sensor_gain"](Context(MACHINES["arm"], np.random.default_rng(seed), ()))(1e4)
        for seed in range(8)
    ]
    assert {round(gain.parameters["gain"], 9) for gain in gains} == {0.2, 5.0}


def test_library_holds_every_kind_of_effect_that_a_diagnosis_may_name() -> None:
    assert len({effect for library in EFFECTS.values() for effect in library}) >= 30


@pytest.mark.parametrize("family", FAMILIES)
def test_case_is_a_measurement_set_that_its_model_takes_and_is_the_same_every_time(family: str, tmp_path: Path) -> None:
    name = {"O": "cart", "N2": "tanks", "I": "arm"}.get(family, "two-mass")
    wish = Wish(family, name, 3, 4, seconds=2.0)
    answer = write_case(draw_case(wish), tmp_path / "once")
    again = write_case(draw_case(wish), tmp_path / "again")

    model = SymbolicModel(name, find_modelica_model(name).compile())
    bound = bind(load_measurements(tmp_path / "once"), model.inputs, model.outputs)

    assert answer == again
    for file in (tmp_path / "once").iterdir():
        assert file.read_bytes() == (tmp_path / "again" / file.name).read_bytes()
    assert (len(bound.learning), len(bound.held_out)) == (4, 2)
    assert set(MACHINES[name].outputs) <= set(bound.output_names)
    assert all(np.isfinite(value) for value in answer["true_model_rmse_heldout"].values())


@pytest.mark.parametrize("name", [name for name, machine in MACHINES.items() if set(machine.inputs) - machine.commands])
def test_idle_input_is_still_declared_with_a_noise_above_zero(name: str, tmp_path: Path) -> None:
    """A declared 0 would be taken for no declaration, and the tool would assume a noise of its own."""
    case = draw_case(Wish("I", name, 0, 3, seconds=1.0))
    write_case(case, tmp_path)

    sensors = load_measurements(tmp_path).sensors

    assert all(value > 0 for key, value in sensors.items() if "noise_std" in key)


@pytest.mark.parametrize("name", ["drive", "two-mass"])
@pytest.mark.parametrize("noise", ["lo", "mid", "hi"])
def test_friction_of_a_drive_at_one_speed_is_plain_but_its_law_is_not(name: str, noise: str) -> None:
    case = draw_case(Wish("I", name, 0, 3, noise=noise))
    runs = [run_trial(case.machine, plan) for plan in case.plans]
    yardstick = Yardstick.of(case.machine, case.plans, runs, case.recorder, np.random.default_rng(1))
    true = case.injections[0]
    speed = runs[0].v[0, 0]
    pairs = {"b1": ("c1", speed), "b2": ("c2", speed), "c1": ("b1", 1 / speed), "c2": ("b2", 1 / speed)}
    other = {pairs[key][0]: value * pairs[key][1] for key, value in true.values.items()}
    responses = []
    for values in (true.values, other):
        run = run_trial(case.machine, case.plans[0], [Injection("friction", "joint1", {}, values)])
        change = ((run.outputs - runs[0].outputs) / yardstick.noise)[::4].ravel()
        responses.append(change - yardstick.bases[0] @ (yardstick.bases[0].T @ change))
    best = responses[1] @ responses[0] / (responses[1] @ responses[1])

    # Standard deviations, over four learning trials, by which the data prefer the true law to the other at its best.
    law = np.sqrt(4 * np.sum((responses[0] - best * responses[1]) ** 2))

    assert yardstick.enr([true]) > 3.0
    assert law < 2.0


@pytest.mark.parametrize("lag", [0.004, 0.006, 0.1])
def test_a_slow_sensor_answers_an_oscillation_as_the_formula_says(lag: float) -> None:
    """(q - y)/lag = y' answers sin(w t) by (sin(w t) - w lag cos(w t) + w lag e^(-t/lag)) / (1 + (w lag)^2)."""
    w, time = 6.0, np.arange(3000) * 1e-3
    wanted = (np.sin(w * time) - w * lag * (np.cos(w * time) - np.exp(-time / lag))) / (1 + (w * lag) ** 2)

    read = slow_reading(time, np.sin(w * time)[:, None], lag)[:, 0]

    assert np.ptp(wanted) > 1.5
    np.testing.assert_allclose(read, wanted, atol=2e-8)


def test_tendons_are_followed_by_steps_that_are_short_enough_for_the_stiffest() -> None:
    """A fibre hardly activated settles on its tendon within 1/40 ms: a longer step of Runge and Kutta's formula is unstable."""
    time = np.arange(1001) * 1e-3
    before, after = [0.21, 0.32, 0.54, 0.58, 0.08, 0.40, 0, 0], [0.33, 0.27, 0.32, 0.51, 0.51, 0.06, 0, 0]
    inputs = np.array([np.interp(time, [0.53, 0.58], pair) for pair in zip(before, after, strict=True)]).T
    start = [np.array([1.16, 0.93]), np.array([0.59, -1.13])]
    values = {**MACHINES["arm"].values, "strain": 0.03}
    fine_time = np.arange(4001) * 2.5e-4
    fine_inputs = np.array([np.interp(fine_time, time, column) for column in inputs.T]).T

    usual, _ = simulate("arm", values, inputs, *start)
    fine, _ = simulate("arm", values, fine_inputs, *start, step=2.5e-4)

    assert np.ptp(usual[:, 1]) > 0.5  # the elbow turns fast
    np.testing.assert_allclose(usual, fine[::4], atol=1e-7, rtol=0)
