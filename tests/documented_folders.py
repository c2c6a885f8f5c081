"""What a reader of a page has before the first command of it: records and models of his own, which the page does not give."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from tests.blackbox.test_diagnosis_of_an_fmu import drive_data
from tests.diagnosis.test_user_cards import swings
from tests.documented_commands import files
from tests.laws.oscillator import MODEL, recorded

PAGES = Path(__file__).parents[1] / "docs"


def drive(folder: Path) -> None:
    """An FMU of a drive, and records of one that has friction."""
    drive_data(folder / "data", "viscous_friction")
    build_fmu(find_modelica_model("drive").compile(), folder / "drive.fmu", fmi_version="2.0")


def swings_in_degrees(folder: Path) -> None:
    """Records of a pendulum whose angle is said to be in radians, and is in degrees."""
    for path in swings(folder / "data").glob("*.csv"):
        rows = np.loadtxt(path, delimiter=",", skiprows=1) * [1.0, 180.0 / np.pi]
        np.savetxt(path, rows, delimiter=",", header="time,theta", comments="", fmt="%.9g")


def braked_mass(folder: Path) -> None:
    """A mass on a spring with a brake that no card knows."""
    recorded(folder / "data", lambda t, x, v: -4.0 * v / (1 + (v / 0.3) ** 2), seed=3)
    (folder / "Mass.mo").write_text(MODEL)


def plant(folder: Path) -> None:
    """A package with a class."""
    (folder / "path").mkdir()
    (folder / "path/My.mo").write_text(f"package My\n{MODEL.replace('Mass', 'Plant')}end My;\n")


def team(folder: Path) -> None:
    """The repository of the page's team."""
    shutil.copytree(PAGES / "examples/regress_team", folder, dirs_exist_ok=True)


def arm_data(folder: Path) -> None:
    """Records of an arm."""
    shutil.copytree(PAGES.parent / "tests/cases/arm/case_003", folder / "data")


def coupled(folder: Path) -> None:
    """The system of the tutorial."""
    for name, text in files(PAGES / "tutorials/identify_a_robot.md").items():
        (folder / name).write_text(text)


def pushed_mass(folder: Path) -> None:
    """A system of one mass that can be pushed."""
    (folder / "Mass.mo").write_text(
        'model Mass\n  parameter Real m(unit="kg") = 1;\n  input Real Fb(unit="N");\n  output Real x(unit="m", start=0, fixed=true);\n'
        '  Real v(unit="m/s", start=0, fixed=true);\nequation\n  der(x) = v;\n  m*der(v) = Fb;\nend Mass;\n'
    )
    (folder / "pair.toml").write_text('[run]\nstep = 0.1\n[components.mass]\nmodelica = "Mass.mo:Mass"\n')


BEFORE: dict[str, Callable[[Path], object]] = {
    "bench.md": coupled,
    "black_box_fmus.md": drive,
    "cosimulation.md": pushed_mass,
    "data_checks.md": swings_in_degrees,
    "effect_cards.md": lambda folder: swings(folder / "swings"),
    "fmus.md": plant,
    "laws.md": braked_mass,
    "regress.md": team,
    "scale.md": arm_data,
}
