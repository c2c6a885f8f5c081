"""`misfit validate`: one line a finding, exit code 1 if there is any, and the same as JSON."""

import json
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fmpy.model_description import ValidationError

from fmus.archive import read_archive
from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from fmus.validate import validate_fmu
from tests.in_process import misfit_here


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A good FMU, and the same with a variable in a unit that it does not have."""
    folder = tmp_path_factory.mktemp("fmus")
    good = build_fmu(find_modelica_model("drive").compile(), folder / "good.fmu")
    bad = folder / "bad.fmu"
    with zipfile.ZipFile(bad, "w") as archive:
        for name, content in read_archive(good).items():
            archive.writestr(name, content.replace(b'kg="1" m="2" s="-2"', b'kg="1" m="1" s="-2"'))
    return good, bad


def test_a_good_fmu_ends_with_code_0_and_one_line(fmus: tuple[Path, Path]) -> None:
    done = misfit_here("validate", fmus[0])
    assert (done.returncode, done.stdout) == (0, "1 FMU without findings\n")


def test_findings_end_with_code_1_and_name_the_file(fmus: tuple[Path, Path]) -> None:
    done = misfit_here("validate", *fmus)
    assert done.returncode == 1
    assert "unit 'N.m' is defined as kg1.m1.s-2, but means kg1.m2.s-2" in done.stdout
    assert all(line.startswith(f"{fmus[1]}: ") for line in done.stdout.splitlines())


def test_json_holds_the_findings_of_every_file(fmus: tuple[Path, Path]) -> None:
    done = misfit_here("validate", *fmus, "--json", "-")
    document = json.loads(done.stdout)
    assert done.returncode == 1
    assert document["schema"] == "misfit.validate/1"
    good, bad = document["fmus"]
    assert good == {"file": str(fmus[0]), "findings": [], "notes": []}
    assert bad["findings"]


def test_a_file_that_is_no_fmu_keeps_no_other_from_being_checked(fmus: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "empty.fmu").write_bytes(b"")
    (tmp_path / "loop.fmu").symlink_to("loop.fmu")
    files = [tmp_path / "empty.fmu", fmus[1], tmp_path / "loop.fmu"]

    done = misfit_here("validate", *files)

    assert done.returncode == 2 and done.stderr == ""
    lines = done.stdout.splitlines()
    assert "cannot be read as a zip archive" in lines[0] and "but means" in lines[1] and "does not exist" in lines[-1]


def test_threads_read_schemas_one_after_another(fmus: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    reading: list[str] = []

    def overlapping(folder: str, **_: object) -> None:
        reading.append(folder)
        time.sleep(0.02)
        others = len(reading) - 1
        reading.remove(folder)
        raise ValidationError([f"{others} others read a schema meanwhile"])

    monkeypatch.setattr("fmpy.read_model_description", overlapping)
    with ThreadPoolExecutor(4) as pool:
        findings = list(pool.map(validate_fmu, [fmus[0]] * 4))
    assert findings == [["0 others read a schema meanwhile"]] * 4


def test_a_file_that_is_no_fmu_ends_with_code_2(tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("no archive")
    done = misfit_here("validate", tmp_path / "text.fmu")
    assert done.returncode == 2
    assert "text.fmu is not an FMU" in done.stderr
    assert len(done.stderr.splitlines()) == 1
