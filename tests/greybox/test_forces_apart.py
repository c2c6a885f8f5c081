"""Where two laws that explain a record alike are told apart: values from the laws' own formulas."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.forces_apart import where_forces_differ
from orchestrator.greybox.laws import Law, LawParameter
from orchestrator.greybox.places import Place

SHAFT = Place("motion", "w", "N.m", {"v": "w", "t": "time"}, {"tau": 1.0})
SPEED = SimpleNamespace(name="w", unit="rad/s")


def law(expression: str, states: dict[str, str] | None = None, **values: float) -> tuple[Any, Candidate]:
    """A fitted set with one law of the shaft, and that law."""
    parameters = tuple(LawParameter(name, "1") for name in values)
    candidate = Candidate(Law("law", "law", SHAFT, expression, parameters, states=states or {}), SHAFT)
    return SimpleNamespace(value=lambda candidate, name: (values[name], 0.0)), candidate


def outcome(speeds: np.ndarray) -> Any:
    """The search of a shaft whose speed was seen over ten seconds."""
    trial = SimpleNamespace(inputs=np.zeros((len(speeds), 0)), time=np.linspace(0, 10, len(speeds)))
    t, x, none = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX(0, 1)
    rates = ca.Function("rhs", [t, x, none, none, none], [-x, none])
    system = SimpleNamespace(states=[SPEED], inputs=[], algebraics=[], parameters=[], n_delays=0, rhs=rates)
    box = SimpleNamespace(system=system)
    fit = SimpleNamespace(runs=[SimpleNamespace(mean=speeds[:, None])], trials=[trial], box=box)
    return SimpleNamespace(nominal=SimpleNamespace(fit=fit), case=SimpleNamespace(base=box.system, inputs=[]))


def test_forces_that_are_alike_forward_are_told_apart_backward() -> None:
    constant, dry = law("-c", c=0.2), law("-c*tanh(v)", c=0.2)

    where = where_forces_differ(outcome(np.linspace(10, 20, 50)), constant, dry)

    place, _, forces = where.partition(": there it is ")
    assert place.startswith("w = -") and place.endswith(" rad/s") and forces == "-0.2 against 0.2 N.m"


def test_a_force_that_depends_on_time_is_told_from_drag() -> None:
    wave, drag = law("A*sin(t)", A=0.3), law("-d*v", d=0.01)

    where = where_forces_differ(outcome(np.linspace(-1, 1, 50)), wave, drag)

    assert " s and w = " in where and where.startswith("time = ")


def test_a_force_that_has_no_value_beyond_the_record_is_compared_where_it_has() -> None:
    where = where_forces_differ(outcome(np.linspace(0.1, 2, 50)), law("c*sqrt(v)", c=1.0), law("d*v", d=1.0))

    assert float(where.split("against ")[1].split()[0]) != 0.0


def test_equal_forces_and_forces_with_a_memory_are_told_apart_nowhere() -> None:
    seen, drag = outcome(np.linspace(-1, 1, 50)), law("-d*v", d=0.01)

    assert where_forces_differ(seen, drag, law("-0.01*v")) == ""
    assert where_forces_differ(seen, drag, law("-z", {"z": "v - z"})) == ""
