"""Players, functions, controllers and a user's own class as components."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import ComponentSpec
from orchestrator.cosim.kinds import describe, kinds, open_component

TRIAL = "time,u,v\n10.0,0,1\n10.5,1,3\n11.5,3,-1\n"
CASE = 'files = ["a.csv", "b.csv"]\nlearning = [1]\nheld_out = [2]\n[columns]\ntime = "s"\nu = "mm"\nv = "1"\n'


def opened(folder, kind, source="", **options):
    return open_component(ComponentSpec("it", kind, source, options=options), folder)


def at(component, time, *names):
    component.step(time, 0.0)
    return component.get(names)


@pytest.fixture
def trial(tmp_path):
    (tmp_path / "a.csv").write_text(TRIAL)
    return tmp_path


def test_a_player_gives_the_straight_line_between_samples_at_the_time_of_the_record(trial):
    player = opened(trial, "player", "a.csv")
    player.initialise(10.0, 11.5, None)
    assert player.get(["u", "v"]) == [0.0, 1.0]
    assert at(player, 10.25, "u", "v") == [0.5, 2.0]
    assert at(player, 11.0, "v", "u") == [1.0, 2.0]


def test_a_player_of_a_long_file_plays_all_of_it(tmp_path):
    rows = "".join(f"{0.1 * k},{k}\n" for k in range(100))
    (tmp_path / "long.csv").write_text(f"time,u\n{rows}")
    assert at(opened(tmp_path, "player", "long.csv"), 9.85, "u") == [pytest.approx(98.5)]


def test_a_player_that_holds_gives_the_last_sample_also_where_time_is_rounded(trial):
    player = opened(trial, "player", "a.csv", interpolation="hold", start=0)
    assert at(player, 0.499, "v") == [1.0]
    assert at(player, sum([0.1] * 5) - 1e-12, "v") == [3.0]
    assert at(player, 1.499, "v") == [3.0]


def test_a_player_takes_units_and_trials_from_the_measurement_set(trial):
    (trial / "b.csv").write_text(TRIAL.replace("11.5,3,-1", "11.5,7,-1"))
    (trial / "case.toml").write_text(CASE)
    player = opened(trial, "player", ".", trial=2, columns=["u"])
    assert [(port.name, port.unit, port.causality) for port in player.ports] == [("u", "mm", "output")]
    assert at(player, 11.5, "u") == [7.0]
    assert at(opened(trial, "player", ".", trial="a.csv"), 11.5, "u") == [3.0]


def test_a_player_can_go_back_to_a_saved_time(trial):
    player = opened(trial, "player", "a.csv")
    player.step(10.0, 0.25)
    state = player.save()
    player.step(10.25, 1.0)
    player.restore(state)
    assert player.get(["u"]) == [0.5]


def test_no_values_are_made_up_outside_the_record(trial):
    player = opened(trial, "player", "a.csv")
    with pytest.raises(ComponentError, match="no values at t = 0 s: it is recorded from 10 s to 11.5 s"):
        player.initialise(0.0, None, None)
    with pytest.raises(ComponentError, match="no values at t = 12 s"):
        player.initialise(10.0, 12.0, None)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"trial": 3}, "trial = 3; a.csv has 1 files; expected trial = a number from 1 or one of 'a.csv'"),
        ({"interpolation": "cubic"}, 'interpolation = \'cubic\'; expected "linear" or "hold"'),
        ({"columns": ["w"]}, "component 'it': a.csv has no column 'w'; "),
        ({"start": "now"}, "start = 'now'; expected a time in s"),
    ],
)
def test_options_of_a_player_that_do_not_fit_are_named(trial, options, words):
    with pytest.raises(MisfitError, match=words):
        opened(trial, "player", "a.csv", **options)


CODE = """
import numpy as np
import control
from orchestrator.cosim import Component, Port, StepEnd

def mix(u1, u2, gain=1.0):
    return gain * (u1 - u2)

def split(u, time):
    return u, u * time

def broken(u):
    return 1.0 / u

def design():
    return control.ss([[-2.0]], [[1.0]], [[3.0]], [[0.0]], inputs=["e"], outputs=["force"])

lag = control.tf([1.0], [0.5, 1.0])
sampled = control.ss([[0.5]], [[1.0]], [[1.0]], [[2.0]], 0.1)

class Counter(Component):
    ports = (Port("n", "output", type="Int32", variability="discrete"),)
    feedthrough = {}
    def __init__(self, first=0):
        self.n = first
    def initialise(self, time, stop, tolerance): pass
    def start(self): pass
    def set(self, names, values): raise KeyError(names[0])
    def get(self, names): return [self.n for _ in names]
    def step(self, time, size):
        self.n += 1
        return StepEnd(time + size)
    def terminate(self): pass

class Half(Component):
    def start(self): pass
"""


@pytest.fixture
def code(tmp_path):
    (tmp_path / "user.py").write_text(CODE)
    return tmp_path


def test_a_function_answers_its_inputs_at_once(code):
    mix = opened(code, "function", "user.py:mix", constants={"gain": 2.0})
    assert [port.name for port in mix.ports] == ["u1", "u2", "y"]
    assert mix.feedthrough == {"y": ("u1", "u2")}
    mix.set(["u2", "u1"], [1.0, 4.0])
    assert mix.get(["y", "u1"]) == [6.0, 4.0]


def test_a_function_of_time_with_two_outputs_and_units(code):
    split = opened(code, "function", "user.py:split", inputs={"u": "m"}, outputs={"same": "m", "more": "m.s"})
    assert [(port.name, port.unit) for port in split.ports] == [("u", "m"), ("same", "m"), ("more", "m.s")]
    split.set(["u"], [3.0])
    split.step(0.0, 2.0)
    assert split.get(["more", "same"]) == [6.0, 3.0]


def test_a_mistake_in_a_function_names_component_time_and_line(code):
    broken = opened(code, "function", "user.py:broken")
    broken.initialise(1.5, None, None)
    line = CODE.splitlines().index("    return 1.0 / u") + 1
    with pytest.raises(
        ComponentError,
        match=rf"component 'it' failed to give y at t = 1.5 s: ZeroDivisionError: .* \(user.py, line {line}\)",
    ):
        broken.get(["y"])
    with pytest.raises(ComponentError, match="2 values returned for the outputs y"):
        opened(code, "function", "user.py:split").get(["y"])


@pytest.mark.parametrize(
    ("kind", "source", "options", "words"),
    [
        ("function", "user.py:mixx", {}, "user.py has no 'mixx'; did you mean 'mix'?"),
        ("function", "none.py:mix", {}, "none.py does not exist"),
        ("function", "user.py", {}, "expected file.py:NAME"),
        ("function", "user.py:mix", {"inputs": ["u1"]}, "user.py:mix needs 'u2'"),
        ("function", "user.py:mix", {"inputs": ["u1", "u2", "u3"]}, "has no argument 'u3'"),
        ("python", "user.py:mix", {}, "is no class that extends orchestrator.cosim.Component"),
        ("python", "user.py:Half", {}, "user.py:Half lacks get, initialise, set, step, terminate"),
        ("python", "user.py:Counter", {"arguments": {"last": 1}}, "cannot be made with arguments {'last': 1}: TypeError"),
        ("controller", "user.py:mix", {}, "user.py:mix failed: TypeError"),
        ("controller", "", {}, "no matrices; expected a, b, c and d"),
        ("controller", "", {"a": [[1.0]], "b": [[1.0, 2.0]], "c": [[1.0]], "d": [[0.0]]}, r"matrix d has the shape \(1, 1\), expected \(1, 2\)"),
        ("controller", "", {"d": [[1.0]], "inputs": ["a", "b"]}, "inputs names 2 signals, the matrices have 1"),
        ("controller", "", {"d": [[1.0]], "sample_time": -1}, "sample_time = -1; expected a time"),
        ("no-such", "", {}, "there is no kind of component 'no-such'"),
    ],
)  # fmt: skip
def test_what_cannot_be_made_says_why(code, kind, source, options, words):
    with pytest.raises(MisfitError, match=words):
        opened(code, kind, source, **options)


def test_a_class_of_the_user_is_a_component(code):
    counter = opened(code, "python", "user.py:Counter", arguments={"first": 5})
    counter.step(0.0, 0.1)
    assert counter.get(["n"]) == [6]
    assert describe(ComponentSpec("c", "python", "user.py:Counter"), code).ports[0].type == "Int32"
    with pytest.raises(ComponentError, match="component 'it' failed to take q at t = 0.1 s: KeyError: 'q'"):
        counter.set(["q"], [1])


def test_a_continuous_controller_advances_exactly_for_a_constant_input():
    a, b, c, d = (
        np.array([[0.0, 1.0], [-4.0, -0.4]]),
        np.array([[0.0], [1.0]]),
        np.array([[1.0, 0.0]]),
        np.array([[0.5]]),
    )
    controller = opened(None, "controller", a=a.tolist(), b=b.tolist(), c=c.tolist(), d=d.tolist())
    controller.set(["x0", "u"], [np.array([1.0, -1.0]), 2.0])
    for k in range(4):
        controller.step(0.3 * k, 0.3)
    exact = solve_ivp(lambda t, x: a @ x + b[:, 0] * 2.0, (0.0, 1.2), [1.0, -1.0], rtol=1e-11, atol=1e-12).y[:, -1]
    assert controller.get(["y"])[0] == pytest.approx(exact[0] + 0.5 * 2.0, rel=1e-9)


def test_a_sampled_controller_is_its_difference_equation(code):
    controller = opened(code, "controller", "user.py:sampled")
    assert (controller.own_step, controller.variable_step) == (0.1, False)
    x, u = 0.0, 3.0
    controller.set(["u"], [u])
    for k in range(5):
        assert controller.get(["y"]) == [pytest.approx(x + 2 * u)]
        controller.step(0.1 * k, 0.1)
        x = 0.5 * x + u
    with pytest.raises(ComponentError, match="sampled every 0.1 s cannot step by 0.25 s"):
        controller.step(0.5, 0.25)


def test_a_design_of_python_control_keeps_its_names_and_says_what_passes_through(code):
    controller = opened(code, "controller", "user.py:design")
    assert [port.name for port in controller.ports] == ["e", "force", "x0"]
    assert controller.feedthrough == {"force": ()}
    lag = opened(code, "controller", "user.py:lag")
    lag.set(["u"], [1.0])
    lag.step(0.0, 0.5)
    assert lag.get(["y"])[0] == pytest.approx(1 - np.exp(-1))


def test_the_derivative_of_a_controller_is_its_matrix_d():
    controller = opened(None, "controller", d=[[1.0, 2.0], [0.0, 3.0]])
    assert controller.feedthrough == {"y1": ("u1", "u2"), "y2": ("u2",)}
    assert controller.derivative(["y2", "y1"], ["u2"], [10.0]) == [30.0, 20.0]
    controller.set(["u1", "u2"], [1.0, 1.0])
    assert controller.get(["y1", "y2"]) == [3.0, 3.0]


def test_all_kinds_can_be_named():
    assert {"fmu", "player", "function", "controller", "python"} <= set(kinds())
