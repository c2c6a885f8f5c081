"""FMUs from strangers: crashes and hangs stay in their own process, errors name the FMU."""

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import ComponentError, FmuError
from fmus.package import build_fmu
from orchestrator.blackbox import process
from orchestrator.blackbox.model import CoupledModel
from orchestrator.blackbox.source import fmu_model

TIME = np.linspace(0, 1, 11)


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


def simulate(model: CoupledModel) -> np.ndarray:
    start = {v.name: v.start or 0.0 for v in model.system.states}
    return model.simulate(TIME, inputs(), ["force"], start)


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("abort();", r"FMU bad.fmu crashed its process \(exit code -6\)"),
        ("*(volatile int *)0 = 1;", r"FMU bad.fmu crashed its process \(exit code -11\)"),
        ("exit(0);", r"FMU bad.fmu crashed its process \(exit code 0\)"),
        ("return fmi2Error;", r"FMU bad.fmu failed: it refused a call between t = 0 s and the next sample"),
    ],
)
def test_crash_in_an_fmu_becomes_an_error_with_its_name(
    statement: str, words: str, muscle: Path, tmp_path: Path
) -> None:
    model = fmu_model(sabotaged(muscle, tmp_path, statement), stepped=True)

    with pytest.raises(ComponentError, match=words):
        simulate(model)
    model.file.close()


def test_hang_in_an_fmu_is_ended_after_the_time_limit(
    muscle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "TIME_LIMIT_S", 2.0)
    model = fmu_model(sabotaged(muscle, tmp_path, "for (;;) {}"), stepped=True)

    with pytest.raises(ComponentError, match=r"bad.fmu gave no answer for 2 s and was stopped"):
        simulate(model)


@pytest.mark.parametrize("fmi_version", ["2.0", "3.0"])
@pytest.mark.parametrize("stepped", [True, False], ids=["co-simulation", "model exchange"])
def test_run_can_be_repeated_and_gives_the_same_numbers(fmi_version: str, stepped: bool, tmp_path: Path) -> None:
    path = build_fmu(find_modelica_model("muscle").compile(), tmp_path / "m.fmu", fmi_version=fmi_version)
    model = fmu_model(path, stepped=stepped)

    first, second = (simulate(model) for _ in range(2))

    model.file.close()
    assert np.array_equal(first, second)
    assert np.ptp(first) > 1


def test_every_way_to_run_an_fmu_gives_the_same_curve(tmp_path: Path) -> None:
    """FMI 2.0 and 3.0, stepped and integrated here; the stepped ones integrate to 1e-8 by themselves."""
    system = find_modelica_model("muscle").compile()
    curves = []
    for fmi_version in ("2.0", "3.0"):
        path = build_fmu(system, tmp_path / f"m{fmi_version}.fmu", fmi_version=fmi_version)
        for stepped in (True, False):
            model = fmu_model(path, stepped=stepped)
            curves.append(simulate(model))
            model.file.close()

    for curve in curves[1:]:
        # FMI 3.0 holds inputs for a step in co-simulation, which costs the square of the step.
        np.testing.assert_allclose(curve, curves[0], rtol=2e-3, atol=2e-3 * np.ptp(curves[0]))
    np.testing.assert_allclose(curves[3], curves[1], rtol=1e-9)


def test_variables_of_an_fmu_carry_units_and_bounds(muscle: Path) -> None:
    model = fmu_model(muscle, stepped=True)

    stimulation = next(v for v in model.inputs if v.name == "stimulation")
    assert (stimulation.unit, stimulation.minimum, stimulation.maximum) == ("1", 0.0, 1.0)
    assert [v.unit for v in model.outputs] == ["N"]


def test_fmu_that_can_neither_be_stepped_nor_integrated_is_refused_by_name(muscle: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(muscle) as source, zipfile.ZipFile(tmp_path / "events.fmu", "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            if entry == "modelDescription.xml":
                text = content.decode().replace('numberOfEventIndicators="0"', 'numberOfEventIndicators="1"')
                start, end = text.index("  <CoSimulation"), text.index("</CoSimulation>") + len("</CoSimulation>")
                content = (text[:start] + text[end:]).encode()
            target.writestr(entry, content)

    with pytest.raises(FmuError, match=r"events\.fmu offers only model exchange with events"):
        fmu_model(tmp_path / "events.fmu")
