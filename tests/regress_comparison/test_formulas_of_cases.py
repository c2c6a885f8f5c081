"""Laws for quantities that no variable holds: formulas in case files."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.comparison import Bounds, Conserved
from orchestrator.regress.execute import execute

CASE = """
model = "two-mass"
[run]
stop = 1.0
step = 0.01
{formulas}
[signals.{name}]
check = "{check}"
{keys}
"""


def case(folder: Path, formulas: str, name: str = "energy", check: str = "conserved", keys: str = "") -> Path:
    path = folder / "masses.regress.toml"
    path.write_text(CASE.format(formulas=formulas, name=name, check=check, keys=keys))
    return path


TANKS = """
model = "tanks"
[run]
stop = 60.0
[formulas]
water = {{ formula = "0.015*(h1 + h2)", unit = "m3" }}
[signals.water]
check = "conserved"
law = "{law}"
absolute = 1e-9
relative = 0.0
"""


def test_water_in_the_tanks_never_rises_without_inflow_and_does_not_stay(tmp_path: Path) -> None:
    path = tmp_path / "tanks.regress.toml"
    verdicts = {}
    for law in ("never_rises", "constant"):
        path.write_text(TANKS.format(law=law))
        done = subprocess.run(
            [str(Path(sys.executable).with_name("misfit")), "regress", path.name, "--json", "out.json", "--quiet"],
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        verdicts[law] = json.loads((tmp_path / "out.json").read_text())["cases"][0]
        assert done.returncode == (0 if law == "never_rises" else 1), done.stderr

    assert verdicts["never_rises"]["verdict"] == "passed"
    # 0.015 m2 x (0.3 m + 0.1 m) = 0.006 m3 to begin with.
    assert "expected 0.006 m3" in verdicts["constant"]["reason"]


def test_a_formula_with_an_unknown_variable_fails_by_the_variable(tmp_path: Path) -> None:
    path = tmp_path / "tanks.regress.toml"
    path.write_text(TANKS.format(law="constant").replace("h2", "h3"))

    outcome = execute(read_cases(path)[0])

    assert outcome.verdict == "failed" and "'h3'" in outcome.reason


def test_formulas_are_read_beside_their_checks(tmp_path: Path) -> None:
    path = case(tmp_path, '[formulas]\nenergy = "0.5*w**2"', keys='law = "never_rises"')

    found = read_cases(path)[0]

    assert found.formulas["energy"].text == "0.5*w**2"
    assert isinstance(found.signals["energy"][0], Conserved) and not isinstance(found.signals["energy"][0], Bounds)


@pytest.mark.parametrize(
    ("formulas", "words"),
    [
        ('[formulas]\npower = "w"', "nothing checks it"),
        ("[formulas]\nenergy = 3", "FORMULA"),
        ('[formulas]\nenergy = "3 +"', "cannot be read"),
        ('[formulas]\nenergy = "3 + 4"', "has no variable"),
    ],
)
def test_formulas_that_cannot_be_are_refused(tmp_path: Path, formulas: str, words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        read_cases(case(tmp_path, formulas))
