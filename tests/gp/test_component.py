"""The block in the loop: friction learned from its formula takes the place of the friction itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import ComponentSpec, Connection, Simulation, System, Value
from orchestrator.cosim.kinds import open_component
from orchestrator.cosim.load import load_system
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import Matern52, OnInputs, Periodic, SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import read_block, write_block
from orchestrator.results.recorder import MemoryRecorder

ARM = Path(__file__).parents[1] / "cosim" / "arm.toml"
ACTIVATIONS = (0.3, 0.1, 0.2, 0.15, 0.05, 0.25)
DAMPING = 0.4  # N.m.s/rad, missing at both joints of the nominal arm
MOMENT_ARMS = {"w1": ("anterior_deltoid", "V_1", "F_1", 0.05), "w2": ("brachialis", "V_6", "F_6", 0.03)}
STOP, STEP = 0.4, 0.001


def friction_block(damping: float, folder: Path, points: int = 33) -> Path:
    """Friction of both joints, -damping w, sampled between -16 and 16 rad/s."""
    w = np.linspace(-16.0, 16.0, points)
    latents = {
        name: Latent(OnInputs((k,), SquaredExponential(100.0, (8.0,)))) for k, name in enumerate(("shoulder", "elbow"))
    }
    x = np.column_stack([w, w])
    seen = tuple(observe(name, x, name, -damping * w, 1e-4) for name in latents)
    outputs = [Output("tau1", "N.m", (Term("shoulder"),)), Output("tau2", "N.m", (Term("elbow"),))]
    block = Block(condition(latents, seen), {"w1": "rad/s", "w2": "rad/s"}, outputs, seen)
    return write_block(block, folder / "friction.json")


def activated(system: System) -> System:
    addresses = [system.inputs[f"alpha_{k}"][0] for k in range(1, 7)]
    return system.with_values(dict(zip(addresses, map(Value, ACTIVATIONS), strict=True)))


def with_block(system: System, block: Path) -> System:
    """The arm in parts, where a block sees joint speeds and its torques are added to one muscle of each joint."""
    components = {**system.components, "gp": ComponentSpec("gp", "gp", str(block))}
    taken = {f"arm.{force}" for *_, force, _ in MOMENT_ARMS.values()}
    connections = [each for each in system.connections if each.target not in taken]
    for k, (speed, (muscle, lengthening, force, arm)) in enumerate(MOMENT_ARMS.items(), 1):
        adder = f"adder{k}"
        components[adder] = ComponentSpec(
            adder,
            "function",
            f"{Path(__file__).parent / 'adders.py'}:pull",
            options={
                "inputs": {"force": "N", "torque": "N.m"},
                "outputs": {"pulled": "N"},
                "constants": {"moment_arm": arm},
            },
        )
        connections += [
            # The muscle lengthens by -moment arm times the joint's speed.
            Connection(f"arm.{lengthening}", f"gp.{speed}", factor=-1.0 / arm, convert=False),
            Connection(f"gp.tau{k}", f"{adder}.torque"),
            Connection(f"{muscle}.F", f"{adder}.force"),
            Connection(f"{adder}.pulled", f"arm.{force}"),
        ]
    return System("corrected", components, tuple(connections), system.inputs, system.outputs, folder=system.folder)


def angles(system: System, **options) -> np.ndarray:
    recorder = MemoryRecorder()
    with Simulation(activated(system), **options) as simulation:
        simulation.run(STOP, recorder)
    found = recorder.result()
    return np.column_stack([found["arm.q1"], found["arm.q2"]])


@pytest.fixture(scope="module")
def parts() -> System:
    return load_system(ARM)


def damped(system: System) -> System:
    return system.with_values({f"arm.linkage.b[{k}]": Value(0.3 + DAMPING) for k in (1, 2)})


def test_a_block_of_zero_torque_leaves_the_trajectory_unchanged(parts, tmp_path):
    plain = angles(parts, step=STEP)
    found = angles(with_block(parts, friction_block(0.0, tmp_path)), step=STEP)
    assert np.abs(found - plain).max() < 1e-12
    assert np.ptp(plain[:, 0]) > 0.1  # rad: it does move


def test_friction_from_the_block_moves_the_arm_as_its_own_friction(parts, tmp_path):
    block = friction_block(DAMPING, tmp_path)
    plain, wanted = angles(parts, step=STEP), angles(damped(parts), step=STEP)
    effect = np.abs(plain - wanted).max()
    found = angles(with_block(parts, block), step=STEP)
    error = np.abs(found - wanted).max()
    # A torque held over a step is late by half of it: the error is of the step's first order.
    half = np.abs(
        angles(with_block(parts, block), step=STEP / 2)[::2] - angles(damped(parts), step=STEP / 2)[::2]
    ).max()
    assert effect > 0.05  # rad
    assert error < 0.01 * effect
    assert half < 0.6 * error


def test_the_iterative_master_closes_the_loop_to_second_order(parts, tmp_path):
    found = angles(with_block(parts, friction_block(DAMPING, tmp_path)), step=STEP, master="iterative")
    wanted = angles(damped(parts), step=STEP, master="iterative")
    assert np.abs(found - wanted).max() < 1e-5


def joint_block() -> tuple[Block, tuple]:
    rng = np.random.default_rng(4)
    latents = {
        "statics": Latent(Matern52(2.0, (0.5, 0.7)) + Periodic(0.3, (1.0, 2.0), (0.5, 0.6))),
        "strong": Latent(SquaredExponential(3.0, (0.4, 0.4)) * Matern52(1.0, (2.0, 2.0))),
    }
    x, a = rng.normal(size=(12, 2)), rng.uniform(size=12)
    seen = (
        observe("alone", x[:6], "statics", rng.normal(size=(6, 2)), 0.1),
        observe("together", x, {"statics": -1.0, "strong": -a}, rng.normal(size=(12, 2)), 0.2),
    )
    terms = (Term("statics", -1.0), Term("strong", -1.0, "alpha"))
    outputs = [Output("fx", "N", terms, 0), Output("fy", "N", terms, 1)]
    return Block(condition(latents, seen), {"q1": "rad", "q2": "rad"}, outputs, seen), seen


@pytest.fixture
def joint(tmp_path):
    block, seen = joint_block()
    return block, open_component(ComponentSpec("gp", "gp", str(write_block(block, tmp_path / "b.json"))), tmp_path)


VALUES = {"q1": 0.3, "q2": -0.2, "alpha": 0.6}


def test_a_saved_block_says_the_same_as_the_posterior_that_was_saved(joint):
    block, component = joint
    component.set(list(VALUES), list(VALUES.values()))
    of, point = {"statics": -1.0, "strong": -0.6}, [[0.3, -0.2]]
    expected = block.posterior.mean(of, point)[0]
    deviation = np.sqrt(block.posterior.variance(of, point)[0])
    assert component.get(["fx", "fy", "fx_sd", "q2"]) == pytest.approx([*expected, deviation, -0.2], rel=1e-12)


def test_ports_have_the_units_and_dependencies_of_the_block(joint):
    _, component = joint
    assert {port.name: port.unit for port in component.ports if port.causality == "input"} == {
        "q1": "rad",
        "q2": "rad",
        "alpha": "1",
    }
    assert component.feedthrough["fy_sd"] == ("q1", "q2", "alpha")


def test_the_directional_derivative_is_the_slope_of_the_outputs(joint):
    _, component = joint
    seed, step = np.array([0.7, -0.4, 0.2]), 1e-6
    around = []
    for sign in (1, -1):
        component.set(list(VALUES), np.array(list(VALUES.values())) + sign * step * seed)
        around.append(np.array(component.get(["fx", "fy", "fy_sd"])))
    component.set(list(VALUES), list(VALUES.values()))
    found = component.derivative(["fx", "fy", "fy_sd"], list(VALUES), seed)
    assert np.allclose(found, (around[0] - around[1]) / (2 * step), rtol=1e-7)


def test_a_block_goes_back_to_its_inputs(joint):
    _, component = joint
    component.set(list(VALUES), list(VALUES.values()))
    kept, before = component.save(), component.get(["fx"])
    component.set(["q1"], [9.0])
    assert component.get(["fx"]) != before
    component.restore(kept)
    assert component.get(["fx"]) == before


def test_a_block_learned_from_a_file_predicts_what_the_file_shows(tmp_path):
    t = np.arange(60) * 0.1
    w = 3.0 * np.sin(t)
    lines = [f"{a:.9g},{b:.9g},{-0.4 * b:.9g},{0.4 * b * b:.9g}" for a, b in zip(t, w, strict=True)]
    (tmp_path / "friction.csv").write_text("\n".join(["time,w,tau,heat", *lines]) + "\n")
    (tmp_path / "case.toml").write_text(
        'files = ["friction.csv"]\nlearning = [1]\n[columns]\ntime = "s"\nw = "rad/s"\ntau = "N.m"\nheat = "W"\n'
    )
    options = {"inputs": ["w"], "outputs": ["tau", "heat"], "kernel": "squared_exponential", "noise": 1e-3}
    component = open_component(ComponentSpec("gp", "gp", "case.toml", options=options), tmp_path)
    component.set(["w"], [1.7])
    assert component.get(["tau"])[0] == pytest.approx(-0.4 * 1.7, abs=2e-3)  # two deviations of the noise
    assert component.get(["heat"])[0] == pytest.approx(0.4 * 1.7**2, abs=2e-3)
    assert 0.0 < component.get(["tau_sd"])[0] < 1e-3
    assert [port.unit for port in component.ports] == ["rad/s", "N.m", "N.m", "W", "W"]


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        ("none.json", {}, "component 'gp': .*none.json cannot be read"),
        ("bad.json", {}, "bad.json is not a saved block: KeyError 'schema'"),
        ("other.json", {}, "schema = 'x'; expected 'misfit.gp/1'"),
        ("other.json", {"noise": 1.0}, "takes no noise; leave it out"),
        ("d.csv", {"inputs": "w"}, "inputs = 'w'; expected columns of d.csv"),
        ("d.csv", {"inputs": ["w"], "outputs": ["tau"]}, "has no column 'tau'"),
        ("d.csv", {"inputs": ["w"], "outputs": ["w"], "kernel": "rbf"}, "kernel = 'rbf'"),
        (
            "d.csv",
            {"inputs": ["w"], "outputs": ["w"], "noise": -1},
            "noise = -1; expected a standard deviation above 0",
        ),
        ("d.csv", {"kernal": "matern32"}, "unknown key 'kernal'; .*kernel"),
    ],
)
def test_what_is_wrong_with_a_block_is_told(source, options, message, tmp_path):
    (tmp_path / "bad.json").write_text("{}")
    (tmp_path / "other.json").write_text('{"schema": "x"}')
    (tmp_path / "d.csv").write_text("time,w\n0,1\n1,2\n")
    with pytest.raises(MisfitError, match=message):
        open_component(ComponentSpec("gp", "gp", source, options=options), tmp_path)


def test_an_input_that_is_no_number_is_told(joint):
    with pytest.raises(ComponentError, match="input q1 = nan; expected a finite number"):
        joint[1].set(["q1"], [float("nan")])


def test_a_prior_mean_cannot_be_saved(tmp_path):
    latents = {"f": Latent(SquaredExponential(1.0, (1.0,)), lambda x: x)}
    seen = (observe("d", [[1.0]], "f", [1.0], 0.1),)
    block = Block(condition(latents, seen), {"x": ""}, [Output("y", "", (Term("f"),))], seen)
    with pytest.raises(MisfitError, match="f has a prior mean that names no model and cannot be saved"):
        write_block(block, tmp_path / "b.json")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"Matern52"', '"Matern72"', "a kernel of the kind 'Matern72'"),
        ('"latent": "strong"', '"latent": "weak"', "fx has the term 'weak'; there are 'statics', 'strong'"),
        ('"factor": -1.0', '"factor": NaN', "a term has the factor nan"),
        ('"component": 1', '"component": 2', "fy is component 3; the data have 2"),
        ('"q2": "rad"', '"q1x": "rad", "q2": "rad"', "3 names of inputs .*, the data have 2 inputs"),
        ('"name": "fy"', '"name": "q1"', "the names of inputs and outputs repeat 'q1'"),
        ('"variance": 2.0', '"variance": "2"', "is not a saved block: TypeError"),
        ('"noise": [', '"noise": [NaN,', "noise of shape"),
    ],
)
def test_a_damaged_block_is_refused_with_the_place(old, new, message, tmp_path):
    block, seen = joint_block()
    path = write_block(block, tmp_path / "b.json")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(MisfitError, match=f"b.json.*({message})"):
        read_block(path)


def test_reading_gives_the_same_bits(tmp_path):
    block, seen = joint_block()
    again = read_block(write_block(block, tmp_path / "b.json"))
    assert np.array_equal(again.posterior.weights, block.posterior.weights)


LEARN = {"learn": {"budget": 30, "noise": 0.05}}


def test_a_block_learns_during_the_run_what_its_learner_would(tmp_path):
    block, seen = joint_block()
    path = write_block(block, tmp_path / "b.json")
    component = open_component(ComponentSpec("gp", "gp", str(path), options=LEARN), tmp_path)
    learner = Learner(block.posterior.latents, 2, 2, 30)
    for each in seen:
        learner.add(each)
    rng = np.random.default_rng(0)
    for k in range(25):
        q1, q2, alpha, fx, fy = rng.normal(size=5)
        component.set(["q1", "q2", "alpha", "fx_seen", "fy_seen"], [q1, q2, alpha, fx, fy])
        component.step(0.01 * k, 0.01)
        learner.add(observe("same", [[q1, q2]], {"statics": -1.0, "strong": -alpha}, [[fx, fy]], 0.05))
    expected = learner.posterior().mean({"statics": -1.0, "strong": -alpha}, [[q1, q2]])[0]
    assert component.get(["fx", "fy"]) == pytest.approx(expected, rel=1e-9)
    assert component.get(["fx_sd"])[0] < 0.05


def test_an_arm_block_learns_the_friction_that_it_sees(tmp_path):
    path = friction_block(0.0, tmp_path, points=2)
    component = open_component(ComponentSpec("gp", "gp", str(path), options=LEARN), tmp_path)
    for k, w in enumerate(np.linspace(-10.0, 10.0, 28)):
        component.set(["w1", "w2", "tau1_seen", "tau2_seen"], [w, -w, -DAMPING * w, 0.0])
        component.step(0.01 * k, 0.01)
    component.set(["w1", "w2"], [5.0, 5.0])
    assert component.get(["tau1", "tau2"]) == pytest.approx([-DAMPING * 5.0, 0.0], abs=0.1)  # two deviations


def test_a_block_that_forgets_the_oldest_follows_friction_that_changes(tmp_path):
    path = friction_block(0.0, tmp_path, points=2)
    errors = {}
    for forget in ("least informative", "oldest"):
        learn = {"budget": 12, "noise": 0.05, "forget": forget}
        component = open_component(ComponentSpec("gp", "gp", str(path), options={"learn": learn}), tmp_path)
        for k, w in enumerate(np.tile(np.linspace(-10.0, 10.0, 6), 6)):
            damping = 0.2 if k < 18 else 0.6  # a bearing runs dry
            component.set(["w1", "w2", "tau1_seen", "tau2_seen"], [w, 0.0, -damping * w, 0.0])
            component.step(0.01 * k, 0.01)
        component.set(["w1", "w2"], [6.0, 0.0])
        errors[forget] = abs(component.get(["tau1"])[0] + 0.6 * 6.0)
    assert errors["oldest"] < 0.1
    assert errors["least informative"] > 3 * errors["oldest"]


@pytest.mark.parametrize(
    ("learn", "message"),
    [
        ({"budget": 0, "noise": 0.1}, "learn = .*; expected { budget"),
        ({"budget": 5}, "learn = .*; expected { budget"),
        (True, "learn = True; expected"),
        ({"budget": 5, "noise": -1.0}, "a standard deviation above 0"),
        ({"budget": 5, "noise": 1.0, "forget": "all"}, "forget = 'all'; expected one of 'least informative', 'oldest'"),
    ],
)
def test_wrong_settings_of_learning_are_told(learn, message, tmp_path):
    path = friction_block(0.1, tmp_path)
    with pytest.raises(MisfitError, match=message):
        open_component(ComponentSpec("gp", "gp", str(path), options={"learn": learn}), tmp_path)


def test_half_of_the_components_cannot_be_learned(tmp_path):
    block, _ = joint_block()
    path = write_block(replace(block, outputs=block.outputs[:1]), tmp_path / "b.json")
    with pytest.raises(MisfitError, match="fx is learned only with all 2 components"):
        open_component(ComponentSpec("gp", "gp", str(path), options=LEARN), tmp_path)
