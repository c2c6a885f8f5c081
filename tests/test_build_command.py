"""`misfit build` with a user's own file: it builds anywhere, and typical mistakes give one line with file and line."""

import os
import subprocess
import sys
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import pytest

START = "model My\n  import SI = FESArm.Units;\n  Real x(start=1, fixed=true);\n"
END = "equation\n  der(x) = -x;\nend My;\n"
LAW = "FESArm.Effects.JointTorque.ViscousFriction"

# Mistake: text, line, words that name the thing.
MISTAKES = {
    "missing semicolon": (f"{START}  Real y = x\n{END}", 4, "';' is missing"),
    "syntax error": (f"{START}equation\n  der(x) = -(x + ;\nend My;\n", 5, "';'"),
    "unknown class": (f"{START}  FESArm.Plants.Pendulun p;\n{END}", 4, "'FESArm.Plants.Pendulun'"),
    "unknown modifier": (f"{START}  FESArm.Plants.Pendulum p(mas=2);\n{END}", 4, "'mas'"),
    "parameter without value": (f"{START}  parameter Real k;\n{END}", 4, "parameter k has no value"),
    "units that differ": (
        f"{START}  SI.Length l;\n  SI.Mass m = 2;\nequation\n  der(x) = -x;\n  l = m;\nend My;\n",
        8,
        "l has m, m has kg",
    ),
    "too few equations": (f"{START}  Real y;\n{END}", 1, "1 equations for 2 unknowns; add 1"),
    "too many equations": (f"{START}equation\n  der(x) = -x;\n  x = 1;\nend My;\n", 1, "remove 1"),
    "wrong type": (f"{START}equation\n  der(x) = -x + true;\nend My;\n", 5, "`Boolean`"),
    "undeclared variable": (f"{START}equation\n  der(x) =\n    -xx;\nend My;\n", 6, "'xx'"),
    "end of a run in an equation": (
        f'{START}equation\n  der(x) = -x;\n  when x < 0.5 then\n    terminate("done");\n  end when;\nend My;\n',
        6,
        "terminate() is not supported",
    ),
    "modifiers of a redeclared class": (
        f"model My\n  extends FESArm.Arms.Arm(\n    redeclare model JointTorque1 = {LAW}(b={{0.2, 0.3}}));\nend My;\n",
        3,
        "b",
    ),
    "connector of the wrong kind": (
        f"{START}  connector P\n    Real e;\n    flow Real f;\n  end P;\n  P p;\nequation\n  der(x) = -x;\n"
        "  connect(p, x);\nend My;\n",
        11,
        "connect argument 'x' must be a connector",
    ),
    "derivative of an expression": (
        f"{START}  Real y;\nequation\n  der(x) = -x;\n  der(x*x) = y;\nend My;\n",
        7,
        "der() of an expression is not supported",
    ),
    "variable shared by outer": (
        f"{START}  inner Real g = 3;\n  A a;\nequation\n  der(x) = -a.y;\nend My;\nmodel A\n  outer Real g;\n  Real y = g;\nend A;\n",
        10,
        "'model World Real g; end World;', 'inner World world', 'outer World world' and world.g",
    ),
    "whole numbers as a vector": (
        f"{START}  Real v[3];\nequation\n  der(x) = -x;\n  v = cross({{1, 0, 0}}, {{0, x, 0}});\nend My;\n",
        1,
        "write {1.0, 0.0, 0.0}",
    ),
    "assignment to a parameter": (
        f"{START}  parameter Real k = 1;\nequation\n  der(x) = -x;\n  k = 2;\nend My;\n",
        1,
        "2 equations for 1 unknowns",
    ),
    "wrong number of arguments": (f"{START}equation\n  der(x) = -sin(x, x);\nend My;\n", 5, "sin() expects 1"),
    "text in another encoding": (f"{START}  // \udcff\n{END}", 4, "0xff is not UTF-8"),
}


def build(folder: Path, text: str) -> "subprocess.CompletedProcess[str]":
    """Build class `My` of a file, in a clean home and away from the repository."""
    home, elsewhere = folder / "home", folder / "elsewhere"
    for path in (home, elsewhere, folder / "mine"):
        path.mkdir(exist_ok=True)
    (folder / "mine" / "My.mo").write_text(text, errors="surrogateescape")
    # The package of this checkout, wherever the test runs.
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "PYTHONPATH": str(Path(__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-m", "orchestrator.cli", "build", "../mine/My.mo:My", "--out", "out"],
        cwd=elsewhere,
        env=environment,
        capture_output=True,
        text=True,
    )


def test_a_file_outside_the_repository_builds_in_a_clean_home(tmp_path: Path) -> None:
    done = build(tmp_path, f"{START}  SI.Factor y = 2*x;\n{END}")
    assert done.returncode == 0, done.stderr
    built = sorted((tmp_path / "elsewhere" / "out").iterdir())
    assert [path.name for path in built] == ["My.fmi3.fmu", "My.fmu"]
    # der(x) = -x from 1.
    result = fmpy.simulate_fmu(str(built[1]), stop_time=1.0, output=["x", "y"])
    assert (result["x"][-1], result["y"][-1]) == pytest.approx((0.36787944, 2 * 0.36787944), rel=1e-6)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_ends_with_code_2_and_one_line_with_file_and_line(mistake: str, tmp_path: Path) -> None:
    text, line, words = MISTAKES[mistake]
    done = build(tmp_path, text)
    assert done.returncode == 2, done.stderr
    (message,) = done.stderr.splitlines()
    assert f"My.mo:{line}: " in message
    assert words in message
    assert not (tmp_path / "elsewhere" / "out").exists()
