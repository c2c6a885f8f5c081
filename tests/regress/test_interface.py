"""Units, types and start values belong to a reference: the same numbers in millimetres are not the same result."""

import json
import shutil
from pathlib import Path

import pytest
from cases_of_balls import case_file, misfit
from faulty import BINARY, binary, description, write_fmu

CASE = 'model = "tank.fmu"\nreference = "ref.csv"\n[run]\nstop = 0.4\nstep = 0.1\n'
MILLIMETRES = (
    ('<Unit name="m">', '<Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit><Unit name="m">'),
    ('<Real unit="m" start="0" max="1000"/>', '<Real unit="mm" start="0" max="1000"/>'),
)
INTEGER = (('<Real unit="m/s" start="1"/>', '<Integer start="1"/>'),)
START = (('<Real unit="m/s" start="1"/>', '<Real unit="m/s" start="2"/>'),)
NEW = (
    ("</ModelVariables>", '<ScalarVariable name="z" valueReference="0" causality="parameter" variability="tunable"><Real start="0"/></ScalarVariable></ModelVariables>'),
)  # fmt: skip


def tank(folder: Path, *changed: tuple[str, str]) -> None:
    """The FMU of a tank, with its description changed."""
    text = description("none")
    for old, new in changed:
        assert old in text
        text = text.replace(old, new)
    write_fmu(folder / "tank.fmu", {"modelDescription.xml": text, BINARY: binary("none")})


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a case whose reference was taken from the unchanged FMU."""
    folder = tmp_path_factory.mktemp("first")
    tank(folder)
    case_file(folder, "fill", CASE)
    assert misfit("--update", "--workers", 1, folder=folder).returncode == 0
    assert misfit("--workers", 1, folder=folder).returncode == 0
    return folder


@pytest.fixture
def kept(first: Path, tmp_path: Path) -> Path:
    """A copy of that folder, to be changed."""
    shutil.copytree(first, tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_the_interface_is_kept_beside_the_values(kept: Path) -> None:
    document = json.loads((kept / "ref.csv.interface.json").read_text())
    assert document["schema"] == "misfit.interface/1"
    assert document["variables"]["y"] == {
        "causality": "output",
        "type": "Float64",
        "unit": "m",
        "variability": "continuous",
        "dimensions": [],
        "start": 0.0,
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (MILLIMETRES, "unit of y was m, is mm"),
        (START, "start of u was 1.0, is 2.0"),
        (INTEGER, "type of u was Float64, is Int32"),
        (NEW, "z is new"),
    ],
)
def test_a_change_of_the_interface_is_a_difference_until_it_is_taken_in(
    kept: Path, change: tuple[tuple[str, str], ...], words: str
) -> None:
    tank(kept, *change)
    (kept / "fill.regress.toml").write_text(
        CASE.replace("[run]", "inputs = { u = 1.0 }\n[run]") if change is START else CASE
    )

    failed = misfit("--workers", 1, "--json", "r.json", folder=kept)
    case = json.loads((kept / "r.json").read_text())["cases"][0]

    assert failed.returncode == 1
    assert case["verdict"] == "failed" and words in failed.stdout and "--update" in failed.stdout

    assert misfit("--update", "--workers", 1, folder=kept).returncode == 0
    assert misfit("--workers", 1, folder=kept).returncode == 0


def test_a_change_that_a_case_allows_is_none_and_values_are_compared_in_their_units(kept: Path) -> None:
    tank(kept, *MILLIMETRES)
    (kept / "fill.regress.toml").write_text(CASE + '[interface]\nallow = ["y.unit"]\n')

    done = misfit("--workers", 1, folder=kept)

    assert done.returncode == 1  # 0.4 mm are not 0.4 m
    assert "interface" not in done.stdout and "mm" in done.stdout


def test_a_reference_without_an_interface_gets_one_by_update(kept: Path) -> None:
    (kept / "ref.csv.interface.json").unlink()
    before = (kept / "ref.csv").read_bytes()

    done = misfit("--workers", 1, "--json", "-", folder=kept)
    assert done.returncode == 0 and "are not compared" in json.loads(done.stdout)["cases"][0]["notes"][0]

    assert misfit("--update", "--workers", 1, folder=kept).returncode == 0
    assert (kept / "ref.csv.interface.json").exists() and (kept / "ref.csv").read_bytes() == before
