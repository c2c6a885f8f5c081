"""FMUs of other makers: those of the Modelica Association have no findings, with events, arrays, strings and binaries.

Their sources are not shipped: MISFIT_REFERENCE_FMUS names a checkout of github.com/modelica/Reference-FMUs.
"""

import os
import subprocess
import zipfile
from pathlib import Path

import pytest
from fmpy import platform, platform_tuple  # type: ignore[import-untyped]

from fmus.validate import validate_fmu

ROOT = os.environ.get("MISFIT_REFERENCE_FMUS")
pytestmark = pytest.mark.skipif(
    ROOT is None, reason="MISFIT_REFERENCE_FMUS names no checkout of modelica/Reference-FMUs"
)

BOTH = ["BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol"]
MODELS = [(2, name) for name in BOTH] + [(3, name) for name in (*BOTH, "Clocks", "StateSpace")]


def build(version: int, name: str, folder: Path, old: str = "", new: str = "") -> Path:
    """Build one of them, with a text of its model replaced."""
    root, library = Path(str(ROOT)), folder / f"{name}.so"
    model = folder / "model.c"
    text = (root / name / "model.c").read_text()
    assert old in text
    model.write_text(text.replace(old, new))
    sources = [model, root / f"src/fmi{version}Functions.c", root / "src/cosimulation.c"]
    flags = ["-shared", "-fPIC", "-fvisibility=hidden", f"-DFMI_VERSION={version}", "-DDISABLE_PREFIX"]
    command = ["cc", *flags, "-I", root / "include", "-I", root / name, *sources, "-lm", "-o", library]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.write(root / name / f"FMI{version}.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{platform if version == 2 else platform_tuple}/{name}.so")
        archive.write(model, "sources/all.c")
        if (root / name / "y.txt").is_file():
            archive.write(root / name / "y.txt", "resources/y.txt")
        if (root / name / "fmi-ls-ref.xml").is_file():
            folder_inside = "extra/org.fmi-standard.fmi-ls-ref"
            archive.write(root / name / "fmi-ls-ref.xml", f"{folder_inside}/fmi-ls-manifest.xml")
            archive.write(root / name / f"{name}_out.csv", f"{folder_inside}/{name}_out.csv")
    return folder / f"{name}.fmu"


@pytest.mark.parametrize(("version", "name"), MODELS)
def test_a_reference_fmu_has_no_findings(version: int, name: str, tmp_path: Path) -> None:
    assert validate_fmu(build(version, name, tmp_path)) == []


@pytest.mark.parametrize("version", [2, 3])
def test_a_wrong_derivative_in_one_is_found(version: int, tmp_path: Path) -> None:
    fmu = build(version, "VanDerPol", tmp_path, "*partialDerivative = 1;", "*partialDerivative = 2;")
    (finding,) = validate_fmu(fmu)
    assert finding.endswith("by 'x1' is given as 2; its values change by 1")
