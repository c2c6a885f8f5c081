"""`misfit learn`: a block of what a model lacks along trials, as a function of its positions and speeds."""

import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.cli.main import main
from orchestrator.cosim.load import load_system
from orchestrator.cosim.run import simulate
from orchestrator.gp.from_trials import Learned, cross_validation, learn_missing
from orchestrator.gp.noise import added_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import read_block
from orchestrator.gp.trials.functions import needed_functions
from orchestrator.gp.trials.judged import Errors, judge, will_not_lose
from orchestrator.measurements import BoundSet, bind, load_measurements
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.symbolic import SymbolicModel
from tests.laws.oscillator import recorded

CASES = Path(__file__).parents[1] / "cases" / "arm"
TIME = np.arange(500) * 0.004
NOISE = 2e-4  # rad
DAMPING = 0.4  # N.m.s/rad, at the elbow, that nobody is told of
ROTOR = """model Rotor
  parameter Real J(unit="kg.m2") = 0.05;
  input Real torque(unit="N.m");
  output Real phi(unit="rad", start=0);
  Real w(unit="rad/s", start=0);
equation
  der(phi) = w;
  J*der(w) = torque;
end Rotor;
"""


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four trials of an arm whose elbow is damped more than the model says, the last one held out."""
    folder, rng = tmp_path_factory.mktemp("trials"), np.random.default_rng(5)
    arm = CompiledModel(find_modelica_model("arm").compile(), ["q1", "q2"], ["linkage.b[2]"])
    names = [v.name for v in arm.system.inputs]
    nominal = next(v.start for v in arm.system.parameters if v.name == "linkage.b[2]")
    for k in range(1, 5):
        alpha = 0.3 + 0.15 * np.sin(2 * np.pi * rng.uniform(0.3, 0.9, 6) * TIME[:, None] + rng.uniform(0.0, 6.0, 6))
        drive = np.zeros((len(TIME), len(names)))
        drive[:, [names.index(f"alpha_{i}") for i in range(1, 7)]] = alpha
        q = arm.run(TIME, drive, arm.with_values([nominal + DAMPING]), np.array([0.8, 1.2, 0, 0]), substeps=2).outputs
        table = np.column_stack([TIME, alpha, q + NOISE * rng.standard_normal(q.shape)])
        header = "time," + ",".join(f"alpha_{i}" for i in range(1, 7)) + ",q1,q2"
        np.savetxt(folder / f"trial_{k}.csv", table, delimiter=",", header=header, comments="")
    files = ", ".join(f'"trial_{k}.csv"' for k in range(1, 5))
    units = "\n".join(f'alpha_{i} = "1"' for i in range(1, 7))
    (folder / "case.toml").write_text(
        f'files = [{files}]\nlearning = [1, 2, 3]\nheld_out = [4]\n[columns]\ntime = "s"\n{units}\nq1 = "rad"\nq2 = "rad"\n'
        f"[sensors]\nencoder_noise_std_rad = {NOISE}\n"
    )
    return folder


@pytest.fixture(scope="module")
def arm() -> SymbolicModel:
    return SymbolicModel("arm", find_modelica_model("arm").compile())


@pytest.fixture(scope="module")
def bound(trials: Path, arm: SymbolicModel) -> BoundSet:
    return bind(load_measurements(trials), arm.inputs, arm.outputs)


@pytest.fixture(scope="module")
def learned(arm: SymbolicModel, bound: BoundSet) -> Learned:
    """What 60 data for each joint teach."""
    return learn_missing(arm.restricted(bound.output_names), bound, 60, [])


@pytest.fixture
def learn(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Exit code, standard output and standard error of `misfit learn`."""

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["misfit", "learn", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


def test_learned_friction_takes_most_of_the_missing_torque_off_a_trial_it_has_not_seen(
    trials: Path, tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    """The block's file gets an ending that the folder beside it has not."""
    code, out, _ = learn(
        "arm", trials, "--out", tmp_path / "block", "--most", "120", "--factors", "none", "--json", "-"
    )

    assert code == 0
    found = json.loads(out)
    assert found["block"] == str(tmp_path / "block.json") and (tmp_path / "block" / "system.toml").is_file()
    elbow = found["held_out"]["q2_missing"]
    assert elbow["unit"] == "N.m"
    assert elbow["after"] < 0.3 * elbow["before"]
    block = read_block(tmp_path / "block.json")
    assert list(block.inputs) == ["q1", "q2", "q1_speed", "q2_speed"]
    middle = block.observations[0].inputs.mean(axis=0)
    slope = np.diff(block.posterior.mean("q2", [middle - [0, 0, 0, 0.3], middle + [0, 0, 0, 0.3]])[:, 0])[0] / 0.6
    assert slope == pytest.approx(-DAMPING, rel=0.15)


def test_a_block_that_makes_held_out_runs_worse_is_refused_with_the_reason(
    tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    """A payload is no function of positions and speeds."""
    case, written = CASES / "case_003", tmp_path / "block.json"
    code, _, _ = learn(
        "arm", case, "--out", written, "--most", "200", "--factors", "none", "--json", tmp_path / "f.json"
    )

    found = json.loads((tmp_path / "f.json").read_text())["free_run"]
    assert code == 1
    assert not written.exists()
    assert found["verdict"] == "refused"
    assert "worse, in trial_0" in found["reason"]
    assert found["as_learned"] > found["held_out_before"] == found["held_out_after"]


def test_a_weak_muscle_stands_out_by_its_own_function_and_free_runs_come_within_a_hundredth(
    tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    code, out, _ = learn(
        "arm", CASES / "case_007", "--out", tmp_path / "block.json", "--most", "120", "--factors", "--json", "-"
    )

    found = json.loads(out)
    assert code == 0
    assert [(each["output"], each["factor"]) for each in found["functions"] if each["verdict"] == "needed"] == [
        ("q1", "alpha_1")
    ]
    (muscle,) = [each for each in found["functions"] if each["verdict"] == "needed"]
    assert muscle["share"] == pytest.approx(-0.35, rel=0.02)  # the case hides a muscle of 0.65 of its strength
    assert len(found["functions"]) == 2 * (1 + 8)  # on each joint: one alone, one a muscle, one a component of the push
    free = found["free_run"]
    assert free["held_out_before"] > 0.3
    assert free["held_out_after"] < 0.01 * free["held_out_before"]
    along = load_system(tmp_path / "block" / "trial_05.toml")
    measured = np.genfromtxt(tmp_path / "block" / "trial_05.csv", delimiter=",", names=True)
    run = simulate(along, stop=2.0)
    seen = measured["time"] <= 2.0
    left = np.interp(measured["time"][seen], run.time, run["model.q1"]) - measured["q1"][seen]
    assert np.sqrt(np.mean(left**2)) < 0.01  # rad, where the model alone is off by 0.4
    signals = np.array([free["signals"][name]["after"] for name in ("q1", "q2")])
    assert free["held_out_after"] == pytest.approx(np.sqrt(np.mean(signals**2)))


def test_a_muscle_without_positions_is_learned_over_the_length_that_drives_it(
    tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    code, out, _ = learn(
        "rat-muscle", CASES.parent / "rat_muscle", "--out", tmp_path / "b.json", "--most", "150", "--json", "-"
    )

    found = json.loads(out)
    assert code == 0
    assert list(read_block(tmp_path / "b.json").inputs) == ["length"]
    assert {each["factor"] for each in found["functions"]} == {None, "stimulation"}
    assert found["free_run"]["held_out_after"] < 0.95 * found["free_run"]["held_out_before"]
    folder = tmp_path / "b"
    trial = sorted(folder.glob("*_OR.toml"))[0]
    samples = np.genfromtxt(trial.with_suffix(".csv"), delimiter=",", names=True)
    run = simulate(load_system(trial), stop=float(samples["time"][200]))
    left = np.interp(samples["time"][:200], run.time, run["model.force"]) - samples["force"][:200]
    alone = found["free_run"]["trials"][trial.with_suffix(".csv").name]["force"]
    assert np.sqrt(np.mean(left**2)) < alone["before"]


def test_a_brake_that_a_model_of_ones_own_lacks_is_learned_with_its_formula_unknown(
    tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    recorded(tmp_path / "data", lambda t, x, v: -4.0 * v / (1 + (v / 0.3) ** 2), seed=3)
    model = f"{tmp_path / 'data' / 'Mass.mo'}:Mass"
    code, out, _ = learn(
        model, tmp_path / "data", "--out", tmp_path / "b.json", "--most", "100", "--factors", "none", "--json", "-"
    )

    assert code == 0
    free = json.loads(out)["free_run"]
    assert free["held_out_after"] < 0.1 * free["held_out_before"]
    block = read_block(tmp_path / "b.json")
    speed = np.array([-0.3, 0.0, 0.3])
    mean, _ = block.predict(block.outputs[0], {"x": np.zeros(3), "x_speed": speed})
    assert mean == pytest.approx(-4.0 * speed / (1 + (speed / 0.3) ** 2), abs=0.06)  # N, a tenth of the largest


def test_a_block_that_is_twice_too_strong_is_shrunk_and_one_that_wins_on_held_out_trials_alone_refused(
    arm: SymbolicModel, bound: BoundSet, learned: Learned
) -> None:
    assert learned.block is not None
    assert learned.judgement is not None
    twice = [
        replace(o, terms=[replace(term, factor=3.0 * term.factor) for term in o.terms]) for o in learned.block.outputs
    ]
    noise = np.full(2, NOISE)

    found = judge(arm, replace(learned.block, outputs=twice), bound.held_out, noise)

    assert found.verdict == "shrunk"
    assert found.refused is not None
    assert found.refused.all > 0.5 * found.before.all
    assert found.after.all < 0.4 * found.before.all

    # A learning trial of an arm that lacks nothing, which the block can only make worse.
    (held,) = bound.held_out
    alone = arm.restricted(bound.output_names)
    right = replace(held, outputs=alone.follow(held.time, held.inputs, held.outputs, alone.signals, noise).outputs)
    chance = judge(alone, learned.block, bound.held_out, noise, [(learned.block, [right])])
    assert chance.verdict == "refused"
    said = re.search(r"may not help along others: .* take it from .* to (.*) in trial_4.csv", chance.reason)
    assert said is not None, chance.reason
    assert float(said[1]) > 0.5 * found.before.all


def test_an_input_that_is_zero_at_all_data_taken_is_not_needed() -> None:
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.0, 1.0, (40, 1))
    seen = observe("q", x, {"q": 1.0, "q:pulse": 0.0}, np.sin(2.0 * x[:, 0]), added_noise(np.full(40, 0.01), 0.01))
    _, verdicts = needed_functions(seen, "q")
    assert [(each.factor, each.needed, each.size > 0.0) for each in verdicts] == [
        ("", True, True),
        ("pulse", False, False),
    ]


def test_of_a_function_and_its_stand_in_times_an_input_that_hardly_moves_one_stays_beside_others_that_are_needed() -> (
    None
):
    """Each of the two can be spared; when both went, an oven's radiation went with them."""
    rng = np.random.default_rng(4)
    x = rng.uniform(-1.0, 1.0, (80, 1))
    room, power = 293.0 + 0.1 * rng.normal(size=80), rng.uniform(size=80)
    lacks = 3.0 * np.sin(2.0 * x[:, 0]) + power * np.cos(x[:, 0])
    seen = observe(
        "T",
        x,
        {"T": 1.0, "T:power": power, "T:room": room},
        lacks + 0.01 * rng.normal(size=80),
        added_noise(np.full(80, 0.01), 0.01),
    )
    found, verdicts = needed_functions(seen, "T")
    needed = [each.factor for each in verdicts if each.needed]
    assert "power" in needed
    assert len(needed) == 2
    posterior, (told,) = condition(found.latents, found.observations), found.observations
    left = lacks - posterior.mean(dict(told.coefficients), x)[:, 0]
    assert np.sqrt(np.mean(left**2)) < 0.02


def test_each_learning_trial_judges_a_block_that_was_made_without_it(bound: BoundSet, learned: Learned) -> None:
    block = learned.block
    assert block is not None
    (seen,) = [each for each in block.observations if each.name == "q2"]
    of_row = np.repeat([0, 1, 2], [21, 20, len(seen.inputs) - 41])
    folds = cross_validation(replace(block, observations=(seen,)), bound.learning, of_row)

    assert [[trial.name for trial in left_out] for _, left_out in folds] == [[t.name] for t in bound.learning]
    for k, (made, _) in enumerate(folds):
        np.testing.assert_array_equal(made.observations[0].inputs, seen.inputs[of_row != k])
        assert made.posterior.latents == block.posterior.latents
    ((alone, asked),) = cross_validation(block, bound.learning[:1], of_row)
    assert alone is block
    assert list(asked) == list(bound.learning[:1])


@pytest.mark.parametrize(
    ("ratios", "kept"),
    [
        ((0.5, 0.6, 0.5, 0.6), True),
        ((0.2, 0.9, 0.3, 0.95), False),
        ((0.9, 0.2), True),
        ((0.002, 0.12, 0.02, 0.006), True),
    ],
)
def test_a_further_trial_must_be_expected_not_to_lose(ratios: tuple[float, ...], kept: bool) -> None:
    """0.5 and 0.6, twice each: mean 0.55, sd 0.058, t(3) = 2.353: limit 0.70. 0.2, 0.9, 0.3, 0.95: 1.62. The last: 0.19."""
    before = Errors({f"trial {k}": {"q": 1.0} for k in range(len(ratios))}, {})
    after = Errors({f"trial {k}": {"q": ratio} for k, ratio in enumerate(ratios)}, {})
    assert will_not_lose((before, after), noise={"q": 0.01}) is kept


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["arm", "nowhere"], "nowhere"),
        (["pendulum.fmu", "DATA"], "equations are closed"),
        (["arm", "DATA", "--factors", "alpha_7"], "alpha_7"),
    ],
)
def test_what_cannot_be_learned_from_is_said_in_one_line(
    trials: Path, learn: Callable[..., tuple[int, str, str]], arguments: list[str], words: str
) -> None:
    code, _, said = learn(*[trials if each == "DATA" else each for each in arguments])

    assert code == 2
    assert words in said
    assert said.count("\n") == 1


def test_torques_that_stay_until_the_next_sample_are_taken_as_such_from_the_data_to_the_coupled_run(
    tmp_path: Path, learn: Callable[..., tuple[int, str, str]]
) -> None:
    (tmp_path / "Rotor.mo").write_text(ROTOR)
    rng, step, files = np.random.default_rng(8), 0.02, []
    time = step * np.arange(300)
    for k in range(4):
        torque, state, rows = np.repeat(rng.normal(size=60), 5), np.zeros(2), []
        for now in torque:
            rows.append(state)
            # Its brake is -0.3 tanh(w), which the model lacks.
            motion = solve_ivp(
                lambda t, x, u=now: (x[1], (u - 0.3 * np.tanh(x[1])) / 0.05), (0.0, step), state, rtol=1e-9
            )
            state = motion.y[:, -1]
        table = np.column_stack([time, torque, np.array(rows)[:, 0] + 1e-4 * rng.normal(size=300)])
        np.savetxt(tmp_path / f"{k}.csv", table, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
        files.append(f'"{k}.csv"')
    (tmp_path / "case.toml").write_text(
        f'files = [{", ".join(files)}]\nlearning = [1, 2, 3]\nheld_out = [4]\n[columns]\ntime = "s"\ntorque = "N.m"\nphi = "rad"\n'
    )

    code, out, _ = learn(
        f"{tmp_path / 'Rotor.mo'}:Rotor", tmp_path, "--out", tmp_path / "b.json", "--most", "100", "--json", "-"
    )

    found = json.loads(out)
    assert code == 0
    assert found["free_run"]["verdict"] == "kept"
    assert found["free_run"]["held_out_after"] < 0.02 * found["free_run"]["held_out_before"]
    samples = np.genfromtxt(tmp_path / "b" / "3.csv", delimiter=",", names=True)
    run = simulate(load_system(tmp_path / "b" / "3.toml"))
    left = np.interp(samples["time"], run.time, run["model.phi"]) - samples["phi"]
    assert np.sqrt(np.mean(left**2)) < 0.02 * found["free_run"]["held_out_before"]  # the model alone is off by 6 rad
