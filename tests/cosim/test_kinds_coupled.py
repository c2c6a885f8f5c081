"""Players, functions, controllers and classes in one system with FMUs, against closed forms."""

import numpy as np
import pytest
from small_fmus import small_fmu
from systems import recorded

from fmus.errors import ComponentError
from orchestrator.cosim.load import load_system

STEP = 0.01


def loaded(folder, text: str):
    for name in ("mass", "spring"):
        (folder / f"{name}.fmu").write_bytes(small_fmu(name).read_bytes())
    (folder / "system.toml").write_text(text)
    return load_system(folder / "system.toml")


def link(start: str, end: str) -> str:
    return f'[[connections]]\nfrom = "{start}"\nto = "{end}"\n'


def test_a_sampled_controller_moves_a_mass_as_the_difference_equation_says(tmp_path):
    system = loaded(
        tmp_path,
        f"[run]\nstep = {STEP}\n[components.mass]\nfmu = 'mass.fmu'\ninterface = 'CoSimulation'\n"
        "[components.pd]\nkind = 'controller'\nd = [[-40.0, -4.0]]\n"
        "inputs = { x = 'm', v = 'm/s' }\noutputs = { f = 'N' }\n"
        + link("mass.x", "pd.x") + link("mass.v", "pd.v") + link("pd.f", "mass.fa"),
    )  # fmt: skip
    result = recorded(system, 1.0)
    state, expected = np.array([1.0, 0.0]), [1.0]
    free, push = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([STEP**2 / 2, STEP])
    for _ in range(100):
        state = free @ state + push * (-40.0 * state[0] - 4.0 * state[1])
        expected.append(state[0])
    assert np.allclose(result["mass.x"], expected, rtol=0, atol=1e-13)


def test_a_recorded_force_in_another_unit_pushes_the_mass(tmp_path):
    rows = "".join(f"{0.1 * k:.1f},{2.0 * k}\n" for k in range(21))
    (tmp_path / "push.csv").write_text(f"time,f\n{rows}")
    (tmp_path / "case.toml").write_text('files = ["push.csv"]\n[columns]\ntime = "s"\nf = "mN"\n')
    system = loaded(
        tmp_path,
        f"[run]\nstep = {STEP}\n[components]\n[components.mass]\nfmu = 'mass.fmu'\ninterface = 'CoSimulation'\n"
        "[components.log]\nplayer = '.'\n" + link("log.f", "mass.fa"),
    )  # fmt: skip
    result = recorded(system, 1.0)
    forces = 0.02 * STEP * np.arange(100)  # N: 20 mN/s, held over each step
    speed = np.concatenate([[0.0], np.cumsum(forces * STEP)])
    assert np.allclose(result["mass.v"], speed, rtol=0, atol=1e-14)
    with pytest.raises(ComponentError, match="push.csv has no values at t = 2.01 s"):
        recorded(system, 2.5)


CODE = """
from orchestrator.cosim import Component, Port, StepEnd

def spring(x, stiffness=10.0):
    return -stiffness * x

def soft(u):
    return 1.0 - u ** 3

class Trapezoid(Component):
    ports = (Port("u", "input", start=0.0), Port("y", "output"))
    feedthrough = {"y": ("u",)}
    def initialise(self, time, stop, tolerance):
        self.u, self.sum, self.half = 0.0, 0.0, 0.0
    def start(self): pass
    def set(self, names, values): self.u = values[0]
    def get(self, names): return [self.sum + self.half * self.u if name == "y" else self.u for name in names]
    def step(self, time, size):
        self.sum += self.half * self.u
        self.half = size / 2
        self.sum += self.half * self.u
        return StepEnd(time + size)
    def terminate(self): pass
"""


def test_a_function_takes_the_place_of_a_spring_to_the_last_bit(tmp_path):
    (tmp_path / "code.py").write_text(CODE)
    head = f"[run]\nstep = {STEP}\n[components.mass]\nfmu = 'mass.fmu'\ninterface = 'CoSimulation'\n"
    spring = "[components.spring]\nfmu = 'spring.fmu'\ninterface = 'CoSimulation'\n"
    one = loaded(tmp_path, head + spring + link("mass.x", "spring.x2") + link("spring.f2", "mass.fa"))
    with_fmu = recorded(one, 1.0)["mass.x"]
    function = "[components.spring]\nfunction = 'code.py:spring'\n"
    other = loaded(tmp_path, head + function + link("mass.x", "spring.x") + link("spring.y", "mass.fa"))
    assert np.array_equal(recorded(other, 1.0)["mass.x"], with_fmu)


def test_a_loop_of_functions_is_solved(tmp_path):
    """u = 1 - u^3 has the real root 0.6823278."""
    (tmp_path / "code.py").write_text(CODE)
    text = f"[run]\nstep = {STEP}\n[components.f]\nfunction = 'code.py:soft'\n" + link("f.y", "f.u")
    (tmp_path / "loop.toml").write_text(text)
    result = recorded(load_system(tmp_path / "loop.toml"), 0.05)
    root = np.roots([1.0, 0.0, 1.0, -1.0])
    expected = float(root[np.isreal(root)].real[0])
    assert np.allclose(result["f.y"], expected, rtol=0, atol=1e-9)


def test_a_class_of_the_user_integrates_what_an_fmu_gives(tmp_path):
    (tmp_path / "code.py").write_text(CODE)
    system = loaded(
        tmp_path,
        f"[run]\nstep = {STEP}\n[components.mass]\nfmu = 'mass.fmu'\ninterface = 'CoSimulation'\nparameters = {{ fa = 2.0 }}\n"
        "[components.sum]\npython = 'code.py:Trapezoid'\n" + link("mass.v", "sum.u"),
    )  # fmt: skip
    result = recorded(system, 1.0)
    # The speed is a straight line, whose integral the trapezoidal rule gives exactly.
    assert np.allclose(result["sum.y"] + 1.0, result["mass.x"], rtol=0, atol=1e-13)
