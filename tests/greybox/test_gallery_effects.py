"""The gallery's hidden effects as Modelica: what is written back moves as the independent programs of the gallery do."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.symbolic.system import SymbolicSystem
from orchestrator.greybox.effects import with_effects
from orchestrator.greybox.prepare import trials_of
from orchestrator.measurements import BoundTrial
from orchestrator.verdicts.result import Estimate, NamedEffect
from tests.cases.gallery.generate import MACHINES

GALLERY = Path(__file__).parents[1] / "cases" / "gallery"


def _effect(effect_id: str, site: str, **values: float) -> NamedEffect:
    return NamedEffect(effect_id, site, {k: Estimate(v, "", (v, v)) for k, v in values.items()})


def _written(name: str, effect: NamedEffect, folder: Path) -> tuple[SymbolicSystem, str]:
    """The gallery's model with an effect, and its text."""
    base = ModelicaModel(name, MACHINES[name].class_name, GALLERY / name / "Model.mo")
    changed = with_effects(base, [effect], "Plant_1", folder)
    assert changed.file is not None
    return changed.compile(), changed.file.read_text()


def _rates(system: SymbolicSystem, time: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    p = [v.start for v in system.parameters]
    return np.array(system.rhs(time, x, u, [], p)[0]).ravel()


@pytest.mark.parametrize(
    ("name", "effect", "line"),
    [
        (
            "buck",
            _effect("inductor_saturation", "i", k=1 / 14**2),
            "L*der(i) = d*Vin - rL*i - v + inductor1_k*i^2/(1 + inductor1_k*i^2)*inductor1_storage*der(i)",
        ),
        ("reactor", _effect("fouling", "UA", rate=1 / 3600), "UAActual*(Tj - T)"),
        ("cylinder", _effect("internal_leak", "p[1]-p[2]", G=3e-12), "q[1] - A[1]*v - internal1_G*(p[1] - p[2])"),
    ],
)
def test_what_is_written_moves_as_the_machine_does(name: str, effect: NamedEffect, line: str, tmp_path: Path) -> None:
    machine = MACHINES[name]
    system, text = _written(name, effect, tmp_path)
    assert line in text
    right, random = machine.right(True), np.random.default_rng(0)
    for _ in range(3):
        u, x = machine.command(random, 10)[5], machine.start(random)
        x = x + 0.1 * np.abs(x) * random.uniform(-1, 1, len(x))
        time = float(random.uniform(0, 3000))
        np.testing.assert_allclose(_rates(system, time, x, u), right(time, x, u), rtol=1e-6)


def test_a_second_rc_moves_as_the_cell_does(tmp_path: Path) -> None:
    system, _ = _written("battery", _effect("second_rc", "I->U", gain=-0.016, T=640.0), tmp_path)
    x, current = (
        np.array([0.7, 0.02, 0.03]),
        np.array([2.5]),
    )  # the program's third state is a voltage, the model's a current
    p = [v.start for v in system.parameters]
    names = [v.name for v in system.states]
    own = np.array([{"soc": 0.7, "U1": 0.02}.get(name, 0.03 / 0.016) for name in names])
    rates, shown = (np.array(part).ravel() for part in system.rhs(0.0, own, current, [], p))
    expected = MACHINES["battery"].right(True)(0.0, x, current)
    scale = np.array([{"soc": 1.0, "U1": 1.0}.get(name, 0.016) for name in names])
    order = [{"soc": 0, "U1": 1}.get(name, 2) for name in names]
    np.testing.assert_allclose(rates * scale, expected[order], rtol=1e-9)
    voltage = dict(zip([v.name for v in system.algebraics], shown, strict=True))["U"]
    assert voltage == pytest.approx(float(MACHINES["battery"].read(x[None], current[None])[0, 0]))


def test_a_filter_begins_where_a_curved_output_has_the_first_sample() -> None:
    base = ModelicaModel("Cell", "Cell", GALLERY / "battery" / "Model.mo")
    system, balances = base.balanced()
    u, x = np.array([[0.0], [0.0]]), np.array([[0.6, 0.0, 0.0]] * 2)
    bound = BoundTrial("one", "learning", np.array([0.0, 1.0]), u, MACHINES["battery"].read(x, u))
    (trial,) = trials_of([bound], system, ("U",), balances)
    given = np.zeros(len(system.inputs))
    shown = system.rhs(0.0, trial.start, given, [], [v.start for v in system.parameters])[1]
    index = [v.name for v in system.algebraics].index("U")
    assert float(shown[index]) == pytest.approx(float(bound.outputs[0, 0]), abs=1e-9)
