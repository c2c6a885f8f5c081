"""What validation finds by running: each test breaks a good FMU in one way."""

import re
import subprocess
import zipfile
from pathlib import Path

import pytest
from helpers_systems import lag

from fmus import validate
from fmus.archive import extract_fmu
from fmus.package import build_fmu
from fmus.validate import validate_fmu

STEP = "int core_step(Core *core, double time, double step)\n{"
RESTORE = "    core->state = snapshot->state;\n"


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "lag.fmu"
    return build_fmu(lag(), path, fmi_version=request.param)


def changed(fmu: Path, folder: Path, file: str, old: str, new: str) -> Path:
    """The same FMU with one text replaced, and its binary made again."""
    extract_fmu(fmu, folder / "fmu")
    target = folder / "fmu" / file
    text = target.read_text()
    assert old in text
    target.write_text(text.replace(old, new))
    if file.startswith("sources/"):
        library = next((folder / "fmu" / "binaries").rglob("*.so"))
        units = map(str, (folder / "fmu" / "sources").glob("*.c"))
        command = ["cc", "-std=c99", "-fPIC", "-shared", "-fvisibility=hidden", "-o", str(library), *units, "-lm"]
        subprocess.run(command, check=True, capture_output=True)
    with zipfile.ZipFile(folder / "bad.fmu", "w") as archive:
        for path in (folder / "fmu").rglob("*"):
            archive.write(path, path.relative_to(folder / "fmu"))
    return folder / "bad.fmu"


BROKEN = {
    "is not the same at every run": (
        STEP,
        STEP + "static int n; core->state.x[0] += 1e-9 * n++;",
        "two equal runs differ",
    ),
    "crashes": (STEP, "#include <stdlib.h>\n" + STEP + "abort();", r"crashed its process \(exit code -6\)"),
    "refuses": (STEP, STEP + 'return core_fail(core, "no");', "running the FMU failed: .*DoStep"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_step_that_goes_wrong_is_a_finding(good: Path, tmp_path: Path, fault: str) -> None:
    old, new, words = BROKEN[fault]
    (finding,) = validate_fmu(changed(good, tmp_path, "sources/step.c", old, new))
    assert re.search(words, finding)


def test_an_incomplete_snapshot_is_a_finding(good: Path, tmp_path: Path) -> None:
    keeps_x = RESTORE + "    core->state.x[0] = 7.0;\n"
    (finding,) = validate_fmu(changed(good, tmp_path, "sources/snapshot.c", RESTORE, keeps_x))
    assert finding.startswith("after its state was restored 'x' is ")


def test_a_hang_ends_after_the_time_limit(good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validate, "TIME_LIMIT_S", 3.0)
    hanging = changed(good, tmp_path, "sources/step.c", STEP, STEP + "for (;;) {}")
    assert validate_fmu(hanging) == ["running the FMU gave no answer for 3 s and was stopped"]


def test_an_undeclared_dependency_is_a_finding(good: Path, tmp_path: Path) -> None:
    # The derivative of x (one-based index 3 in FMI 2.0, reference 2 in FMI 3.0) depends on u and x.
    texts = {
        'index="3" dependencies="1 2"': 'index="3" dependencies="1"',
        'valueReference="2" dependencies="0 1"': 'valueReference="2" dependencies="0"',
    }
    extract_fmu(good, tmp_path / "look")
    description = (tmp_path / "look" / "modelDescription.xml").read_text()
    old = next(text for text in texts if text in description)
    bad = changed(good, tmp_path, "modelDescription.xml", old, texts[old])
    (finding,) = validate_fmu(bad)
    assert finding == "'der(x)' changes with 'x', which it does not declare"
