"""A run that fails says when, which state was lost, and why."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.symbolic import SymbolicModel

CASES = {
    "stiff": ("der(x) = -5e4*(x - u)", 0.0, "x = ", "the model is stiff: a time constant of 2e-05 s"),
    "unstable": ("der(x) = 2*x^3", 1.0, "x = ", "grows without bound"),
    "output": ("der(x) = -1", 0.55, "y is no number", "a logarithm of a negative number"),
    "no number": ("der(x) = -sqrt(x)", 1.0, "der(x) is no number", "a root or a logarithm of a negative number"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_failing_run_names_time_state_and_reason(name: str, tmp_path: Path) -> None:
    equation, start, state, reason = CASES[name]
    output = "log(x)" if name == "output" else "x"
    (tmp_path / "M.mo").write_text(
        f"model M\n  input Real u;\n  output Real x(start={start}, fixed=true);\n  output Real y = {output};\n"
        f"equation\n  {equation};\nend M;\n"
    )
    model = CompiledModel(find_modelica_model(f"{tmp_path / 'M.mo'}:M").compile(), ["x", "y"])
    time = np.arange(0, 5, 0.01)
    with pytest.raises(ComponentError) as caught:
        model.run(time, np.ones((len(time), 1)), model.parameters, np.array([start]))
    message = str(caught.value)
    assert "M left the finite numbers at t = " in message and state in message and reason in message
    assert "\n" not in message
    assert str(pickle.loads(pickle.dumps(caught.value))) == message


def test_a_run_that_hangs_on_its_start_without_bound_says_where(tmp_path: Path) -> None:
    (tmp_path / "M.mo").write_text(
        "model M\n  input Real u;\n  output Real x(start=0, fixed=true);\nequation\n  der(x) = 400*(x - u);\nend M;\n"
    )
    model = SymbolicModel("M", find_modelica_model(f"{tmp_path / 'M.mo'}:M").compile())
    time = np.arange(0, 1, 0.01)
    # x stays 0 exactly, yet a start that is off by d has become d exp(400 t), beyond 1e30 d from t = 0.17 s on.
    with pytest.raises(
        ComponentError, match=r"from t = 0\.\d+ s on, where x = .* depends on the start value of x without bound"
    ):
        model.follow(time, np.zeros((len(time), 1)), np.zeros((len(time), 1)), ("x",), np.array([1e-3]))
