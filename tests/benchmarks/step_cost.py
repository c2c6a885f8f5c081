"""The arm's FMUs against a hand-written C program of the same equations and method, driven from C."""

import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy

from fmus.archive import extract_fmu
from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from fmus.runtime.compiler import FLAGS, find_compiler

HERE = Path(__file__).parent
INPUTS = [*(f"alpha_{i}" for i in range(1, 7)), "fx", "fy", "correction_q1", "correction_q2"]
STEP_LIMIT = 1.5  # FMU / hand-written
CALL_LIMIT_NS = 50.0


def step_cost(folder: Path) -> dict[str, tuple[float, str]]:
    """Measure doStep, get and set: name -> value and unit, as `step_cost.c` prints them.

    The programs take turns in one process; each figure is the median of CPU times.
    """
    arguments: list[str] = []
    for version in ("2.0", "3.0"):
        arguments += _fmu(version, folder)
    program = folder / "step_cost"
    # The flags of the FMU: contraction off and no machine-specific instructions, for either of the two.
    flags = [flag for flag in FLAGS if flag not in ("-shared", "-fPIC", "-fvisibility=hidden")]
    headers = Path(fmpy.__file__).parent / "c-code"
    files = [str(HERE / "step_cost.c"), str(HERE / "arm_by_hand.c")]
    subprocess.run(
        [*find_compiler(), *flags, f"-I{headers}", "-o", str(program), *files, "-ldl", "-lm"], check=True, timeout=60
    )
    done = subprocess.run([str(program), *arguments], check=True, timeout=300, capture_output=True, text=True)
    rows = (line.split() for line in done.stdout.splitlines())
    return {name: (float(value), unit) for name, value, unit in rows}


def print_table(folder: Path) -> bool:
    """Measure, print one line a figure, and tell whether all are within the limits."""
    figures = step_cost(folder)
    print(f"\n{'1 ms of the arm at tolerance 1e-6, driven from C':52s}")
    for name, (value, unit) in figures.items():
        print(f"{name:52s} {value:.4g} {unit if unit != '1' else ''}")
    late = [name for name, (value, _) in figures.items() if name.endswith("ratio") and value > STEP_LIMIT]
    late += [
        name for name, (value, _) in figures.items() if name.startswith(("get_", "set_")) and value >= CALL_LIMIT_NS
    ]
    print(f"above the limits ({STEP_LIMIT} times, {CALL_LIMIT_NS:.0f} ns): {', '.join(late) or 'none'}")
    return not late


def _fmu(version: str, folder: Path) -> list[str]:
    fmu = build_fmu(find_modelica_model("arm").compile(), folder / f"arm{version}.fmu", fmi_version=version)
    unpacked = extract_fmu(fmu, folder / f"arm{version}")
    description = fmpy.read_model_description(str(unpacked))
    references = {v.name: v.valueReference for v in description.modelVariables}
    names = [*INPUTS, "q1", "q2", "Kp"]
    identifier = description.coSimulation.modelIdentifier
    (binary,) = unpacked.glob(f"binaries/*/{identifier}{fmpy.sharedLibraryExtension}")
    return [str(binary), description.guid, " ".join(str(references[name]) for name in names)]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        sys.exit(0 if print_table(Path(name)) else 1)
