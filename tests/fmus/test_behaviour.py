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
from fmus.reference_files import reference_files
from fmus.validate import validate_fmu

STEP = "int core_step(Core *core, double time, double step)\n{"
RESTORE = "    core->state = snapshot->state;\n"
SERIALIZE = "    header.state = snapshot->state;\n"
REFERENCE = "extra/org.fmi-standard.fmi-ls-ref/reference.csv"


STOP_S, STEP_S = 1.0, 0.004
COMPILE = ["cc", "-std=c99", "-O0", "-fPIC", "-fvisibility=hidden"]


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A good FMU; beside it lie the objects of its sources, of which a test makes one again."""
    path = tmp_path_factory.mktemp("good") / "lag.fmu"
    files = reference_files(lag(), STOP_S, STEP_S)
    build_fmu(lag(), path, fmi_version=request.param, extra_files=files, stop_time=STOP_S, step_size=STEP_S)
    extract_fmu(path, path.parent / "objects")
    subprocess.run([*COMPILE, "-c", *_units(path.parent / "objects")], check=True, cwd=path.parent)
    return path


def _units(fmu: Path) -> list[str]:
    return sorted(map(str, (fmu / "sources").glob("*.c")))


def changed(fmu: Path, folder: Path, file: str, old: str, new: str) -> Path:
    """The same FMU with one text replaced, and its binary made again."""
    extract_fmu(fmu, folder / "fmu")
    target = folder / "fmu" / file
    text = target.read_text()
    assert old in text
    target.write_text(text.replace(old, new))
    if file.startswith("sources/"):
        library = next((folder / "fmu" / "binaries").rglob("*.so"))
        others = [str(path) for path in fmu.parent.glob("*.o") if path.stem != target.stem]
        command = [*COMPILE, "-shared", "-o", str(library), str(target), *others, "-lm"]
        subprocess.run(command, check=True, capture_output=True)
    with zipfile.ZipFile(folder / "bad.fmu", "w") as archive:
        for path in (folder / "fmu").rglob("*"):
            archive.write(path, path.relative_to(folder / "fmu"))
    return folder / "bad.fmu"


# Fault: file, text, its replacement, the finding that it has to lead to.
BROKEN = {
    "is not the same at every run": (
        "step.c",
        STEP,
        STEP + "static int n; core->state.x[0] += 1e-9 * n++;",
        "two equal runs differ in 'x'",
    ),
    "shares memory between threads": (
        "step.c",
        STEP,
        STEP
        + """
            static volatile double shared;
            shared = core->state.x[0];
            extern int usleep(unsigned);
            usleep(2000); /* long enough for the others, however busy the machine is */
            core->state.x[0] = shared;
        """,
        "with others in parallel '",
    ),
    "crashes": (
        "step.c",
        STEP,
        "#include <stdlib.h>\n" + STEP + "abort();",
        r"checking two equal runs crashed its process \(exit code -6\)",
    ),
    "refuses steps": (
        "step.c",
        STEP,
        STEP + 'return core_fail(core, "no");',
        "checking two equal runs failed: .*DoStep",
    ),
    "drifts": ("step.c", STEP, STEP + "core->state.x[0] += 1e-3;", "the reference says .*, at most .* apart"),
    "integrates differently": (
        "step.c",
        STEP,
        STEP + "core->state.x[0] += 1e-3;",
        "of co-simulation and of model exchange differ by",
    ),
    "keeps a part of its state": (
        "snapshot.c",
        RESTORE,
        RESTORE + "    core->state.x[0] = 7.0;\n",
        "after its state was restored 'x' is ",
    ),
    "writes a part of its state": (
        "snapshot.c",
        SERIALIZE,
        SERIALIZE + "    header.state.x[0] = 7.0;\n",
        "in an instance given the state's bytes 'x' is ",
    ),
    "has wrong derivatives": (
        "tangent.c",
        "*sensitivity_of(&change, knowns[i]) += seed[i];",
        "*sensitivity_of(&change, knowns[i]) += 2.0 * seed[i];",
        r"the derivative of 'der\(x\)' by 'x' is given as -10; its values change by -5",
    ),
    "has a start value that is no number": (
        "core.c",
        "const double parameter_starts[] = MODEL_PARAMETER_STARTS;",
        "const double parameter_starts[] = {0.0, 0.0};",
        r"after initialisation 'rate' is inf; expected a finite number",
    ),
    "has another start value": (
        "core.c",
        "const double parameter_starts[] = MODEL_PARAMETER_STARTS;",
        "const double parameter_starts[] = {0.5, 0.1};",
        r"after initialisation 'tau' is 0\.5; its start value is 0\.2",
    ),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_an_fmu_that_misbehaves_is_a_finding(good: Path, tmp_path: Path, fault: str) -> None:
    file, old, new, words = BROKEN[fault]
    findings = validate_fmu(changed(good, tmp_path, f"sources/{file}", old, new))
    assert any(re.search(words, finding) for finding in findings), findings
    assert all("\n" not in finding for finding in findings)


def test_a_good_fmu_with_reference_results_has_no_findings(good: Path) -> None:
    assert validate_fmu(good) == []


def test_a_corrupted_reference_is_a_finding(good: Path, tmp_path: Path) -> None:
    extract_fmu(good, tmp_path / "look")
    row = (tmp_path / "look" / REFERENCE).read_text().splitlines()[100]
    time, x, late = row.split(",")
    (finding,) = validate_fmu(changed(good, tmp_path, REFERENCE, row, f"{time},{float(x) + 0.01},{late}"))
    assert re.fullmatch(rf"'x' is \S+ at t = {time} s; the reference says \S+, at most \S+ apart", finding)


UNREADABLE = {
    "time,x": ("tome,x", "reference.csv needs a first column 'time'"),
    "x,late": (
        "x,lote",
        "the reference results name 'lote', which is no variable of the FMU|gives no positive tolerance",
    ),
}


@pytest.mark.parametrize("old", UNREADABLE)
def test_an_unreadable_reference_is_a_finding(good: Path, tmp_path: Path, old: str) -> None:
    new, words = UNREADABLE[old]
    (finding,) = validate_fmu(changed(good, tmp_path, REFERENCE, old, new))
    assert re.search(words, finding)


@pytest.mark.parametrize("source", ["missing.csv", "../../../../../../etc/passwd"])
def test_a_reference_outside_the_fmu_is_a_finding(good: Path, tmp_path: Path, source: str) -> None:
    manifest = "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml"
    (finding,) = validate_fmu(changed(good, tmp_path, manifest, 'source="reference.csv"', f'source="{source}"'))
    assert finding.endswith(f"names {source!r}, which is not in the FMU")


def test_a_hang_ends_after_the_time_limit(good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validate, "TIME_LIMIT_S", 2.0)
    hanging = changed(good, tmp_path, "sources/step.c", STEP, "extern int pause(void);\n" + STEP + "for (;;) pause();")
    assert validate_fmu(hanging) == ["checking two equal runs gave no answer for 2 s and was stopped"]


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
    assert "'der(x)' changes with 'x', which it does not declare" in validate_fmu(bad)


def test_a_unit_that_means_something_else_is_a_finding(good: Path, tmp_path: Path) -> None:
    newton_metre = '<BaseUnit kg="1" m="2" s="-2" />'
    bad = changed(good, tmp_path, "modelDescription.xml", newton_metre, newton_metre.replace('m="2"', 'm="1"'))
    findings = validate_fmu(bad)
    assert "unit 'N.m' is defined as kg1.m1.s-2, but means kg1.m2.s-2" in findings
    assert any(f.startswith("'der(x)' has the unit ") and f.endswith("in 'N.m'") for f in findings)
