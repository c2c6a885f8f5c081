"""A run that fails says when, which state was lost, and why."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError
from orchestrator.models.compiled import CompiledModel

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
