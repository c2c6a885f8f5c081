"""FMUs from strangers: crashes and hangs stay in their own process, errors name the FMU."""

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError, FmuError
from fmus.package import build_fmu
from orchestrator.models import fmu as fmu_module
from orchestrator.models.fmu import FmuModel

TIME = np.linspace(0, 1, 11)
DO_STEP = "fmi2Status fmi2DoStep("


@pytest.fixture(scope="module")
def muscle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(find_modelica_model("muscle").compile(), tmp_path_factory.mktemp("fmu") / "muscle.fmu")


def sabotaged(muscle: Path, folder: Path, statement: str) -> Path:
    """The same FMU with a statement at the beginning of its doStep, rebuilt from its own sources."""
    with zipfile.ZipFile(muscle) as archive:
        archive.extractall(folder / "fmu")
    sources = folder / "fmu" / "sources"
    changed = 0
    for file in sources.glob("*.c"):
        text = file.read_text()
        position = text.find("fmi2DoStep(")
        if position >= 0 and "{" in text[position:]:
            brace = text.index("{", position) + 1
            file.write_text("#include <stdlib.h>\n" + text[:brace] + statement + text[brace:])
            changed += 1
    assert changed == 1
    library = next((folder / "fmu" / "binaries").rglob("*.so"))
    command = ["cc", "-std=c99", "-fPIC", "-shared", "-o", str(library), *map(str, sources.glob("*.c")), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    target = folder / "bad.fmu"
    with zipfile.ZipFile(target, "w") as archive:
        for path in (folder / "fmu").rglob("*"):
            archive.write(path, path.relative_to(folder / "fmu"))
    return target


def inputs() -> np.ndarray:
    return np.column_stack([np.linspace(0, 1, 11), np.full(11, 0.043), np.zeros(11)])


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("abort();", r"FMU bad.fmu crashed its process \(exit code -6\)"),
        ("*(volatile int *)0 = 1;", r"FMU bad.fmu crashed its process \(exit code -11\)"),
        ("exit(0);", r"FMU bad.fmu crashed its process \(exit code 0\)"),
        ("return fmi2Error;", r"FMU bad.fmu failed: .*fmi2DoStep"),
    ],
)
def test_crash_in_an_fmu_becomes_an_error_with_its_name(
    statement: str, words: str, muscle: Path, tmp_path: Path
) -> None:
    model = FmuModel(sabotaged(muscle, tmp_path, statement))

    with pytest.raises(ComponentError, match=words):
        model.simulate(TIME, inputs(), ["force"], {})
    model.close()


def test_hang_in_an_fmu_is_ended_after_the_time_limit(
    muscle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fmu_module, "TIME_LIMIT_S", 5.0)
    model = FmuModel(sabotaged(muscle, tmp_path, "for (;;) {}"))

    with pytest.raises(ComponentError, match=r"bad.fmu gave no answer for 5 s and was stopped"):
        model.simulate(TIME, inputs(), ["force"], {})


def test_run_can_be_repeated_and_gives_the_same_numbers(muscle: Path) -> None:
    model = FmuModel(muscle)

    first, second = (model.simulate(TIME, inputs(), ["force"], {}) for _ in range(2))

    model.close()
    assert np.array_equal(first, second)
    assert np.ptp(first) > 1


def test_variables_of_an_fmu_carry_units_and_bounds(muscle: Path) -> None:
    model = FmuModel(muscle)

    stimulation = next(v for v in model.inputs if v.name == "stimulation")
    assert (stimulation.unit, stimulation.minimum, stimulation.maximum) == ("1", 0.0, 1.0)
    assert [v.unit for v in model.outputs] == ["N"]


def test_fmi_version_that_cannot_be_run_is_refused_by_name(muscle: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(muscle) as source, zipfile.ZipFile(tmp_path / "three.fmu", "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            if entry == "modelDescription.xml":
                content = content.replace(b"<CoSimulation", b"<ModelExchange").replace(
                    b"</CoSimulation", b"</ModelExchange"
                )
            target.writestr(entry, content)

    with pytest.raises(FmuError, match=r"three\.fmu"):
        FmuModel(tmp_path / "three.fmu")
