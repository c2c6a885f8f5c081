"""FMUs that bring sources, or binaries for other systems only, and names that lead out of the archive."""

import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from fmus import sources
from fmus.catalogue import find_modelica_model
from fmus.errors import FmuError
from fmus.package import build_fmu
from fmus.validate import Validation, examine_fmu

sys.path.insert(0, str(Path(__file__).parents[1] / "cosim"))

from small_fmus import small_fmu  # noqa: E402

from orchestrator.cosim.fmu import read_description  # noqa: E402

# Eight to the power of ten times the same declaration.
BOMB = "#define A0 int x;\n" + "".join(f"#define A{k + 1} {f'A{k} ' * 8}\n" for k in range(10)) + "A10\n"


def repacked(path: Path, target: Path, **replaced: str) -> Path:
    """An FMU with other contents for some of its files, by their last name."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            key = Path(name).name.replace(".", "_")
            new.writestr(name, replaced[key] if key in replaced else old.read(name))
    return target


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_sources_are_compiled_and_run(tmp_path: Path, version: str) -> None:
    whole = build_fmu(find_modelica_model("pendulum").compile(), tmp_path / "whole.fmu", fmi_version=version)
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(tmp_path / "bare.fmu", "w") as new:
        for name in old.namelist():
            if not name.startswith("binaries/"):
                new.writestr(name, old.read(name))
    assert examine_fmu(tmp_path / "bare.fmu") == Validation(findings=(), notes=())


def test_what_goes_wrong_in_compiled_sources_is_found(tmp_path: Path) -> None:
    path = small_fmu("decay", sources=True, interfaces=("CoSimulation",))
    with zipfile.ZipFile(path) as archive:
        source = archive.read("sources/decay.c").decode()
    ending = "#include <stdlib.h>\n__attribute__((constructor)) static void end(void) { abort(); }\n"
    found = examine_fmu(repacked(path, tmp_path / "ends.fmu", decay_c=source + ending))
    assert "crashed its process" in found.findings[-1]


def test_sources_that_do_not_compile_are_a_finding(tmp_path: Path) -> None:
    path = repacked(small_fmu("decay", sources=True), tmp_path / "wrong.fmu", decay_c="int f( {")
    found = examine_fmu(path)
    assert "its sources do not compile" in found.findings[-1] and "error" in found.findings[-1]
    assert found.notes == ("not run: there is no binary of it for this system",)


def test_a_binary_for_another_system_only_is_said_and_no_fault() -> None:
    found = examine_fmu(small_fmu("decay", platform="win64"))
    assert found.findings == ()
    assert found.notes[0].startswith("not run: no binary for this system (linux64), and no sources; it has")


def test_compiling_ends_at_its_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = repacked(small_fmu("decay", sources=True), tmp_path / "bomb.fmu", decay_c=BOMB)
    monkeypatch.setattr(sources, "TIME_LIMIT_S", 1.0)
    assert "took more than 1 s and was stopped" in examine_fmu(path).findings[-1]
    monkeypatch.setattr(sources, "TIME_LIMIT_S", 120.0)
    monkeypatch.setattr(sources, "MEMORY_LIMIT_GIB", 0.25)
    assert "took more than 0.25 GiB of memory and was stopped" in examine_fmu(path).findings[-1]


@pytest.mark.parametrize("identifier", ["../../x", "/tmp/x", "a/b", "a\\b", "..", ""])
def test_a_name_that_leaves_the_archive_is_refused(tmp_path: Path, identifier: str) -> None:
    good = shutil.copy(small_fmu("decay"), tmp_path / "good.fmu")
    with zipfile.ZipFile(good) as archive:
        text = archive.read("modelDescription.xml").decode()
    wrong = text.replace('modelIdentifier="decay"', f'modelIdentifier="{identifier}"')
    assert wrong != text
    path = repacked(Path(good), tmp_path / "wrong.fmu", modelDescription_xml=wrong)

    found = examine_fmu(path)
    assert len(found.findings) == 1 and f"modelIdentifier {identifier!r} is no name of a file" in found.findings[0]
    with pytest.raises(FmuError, match="is no name of a file"):
        read_description(path)
