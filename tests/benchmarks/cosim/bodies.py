"""The two systems of the benchmark and their FMUs: a mass on a spring, and a chain of four."""

import json
import subprocess
import zipfile
from pathlib import Path

import fmpy

from fmus.runtime.compiler import find_compiler

HERE = Path(__file__).parent
STEP = 1e-4
PAIRS = {"pair": 1, "chain8": 4}
_UNITS = {
    "m": 'm="1"',
    "m/s": 'm="1" s="-1"',
    "N": 'kg="1" m="1" s="-2"',
    "kg": 'kg="1"',
    "N/m": 'kg="1" s="-2"',
    "N.s/m": 'kg="1" s="-1"',
}
_VARIABLES = {
    "Mass": [("Fa", "input", "N", 0), ("Fb", "input", "N", 0), ("x", "output", "m", None), ("v", "output", "m/s", None),
             ("m", "parameter", "kg", 1), ("x0", "parameter", "m", 1)],
    "Spring": [("x1", "input", "m", 0), ("v1", "input", "m/s", 0), ("x2", "input", "m", 0), ("v2", "input", "m/s", 0),
               ("F1", "output", "N", None), ("F2", "output", "N", None), ("k", "parameter", "N/m", 10), ("d", "parameter", "N.s/m", 0)],
}  # fmt: skip


def parts(pairs: int) -> dict[str, str]:
    """FMU by instance name, masses and springs in turn."""
    return {f"{kind.lower()}{i}": kind for i in range(pairs) for kind in ("Mass", "Spring")}


def connections(pairs: int) -> list[tuple[str, str, str, str]]:
    """(instance, output, instance, input) of every connection: 3 for one pair, 21 for four."""
    found = []
    for i in range(pairs):
        found += [
            (f"mass{i}", "x", f"spring{i}", "x2"),
            (f"mass{i}", "v", f"spring{i}", "v2"),
            (f"spring{i}", "F2", f"mass{i}", "Fa"),
        ]
        if i + 1 < pairs:
            after = f"spring{i + 1}"
            found += [(f"mass{i}", "x", after, "x1"), (f"mass{i}", "v", after, "v1"), (after, "F1", f"mass{i}", "Fb")]
    return found


def build(folder: Path) -> None:
    """Write Mass.fmu, Spring.fmu, their libraries, the hand-written loop, and the systems as TOML."""
    include = Path(fmpy.__file__).parent / "c-code"
    compiler = [*find_compiler(), "-O2", f"-I{include}"]
    for kind in _VARIABLES:
        library = folder / f"{kind}.so"
        subprocess.run(
            [*compiler, "-fPIC", "-shared", f"-D{kind.upper()}", "-o", library, HERE / "bodies.c"], check=True
        )
        with zipfile.ZipFile(folder / f"{kind}.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", _description(kind))
            archive.write(library, f"binaries/linux64/{kind}.so")
    subprocess.run([*compiler, "-o", folder / "loop", HERE / "loop.c", "-ldl"], check=True)
    for pairs in PAIRS.values():
        (folder / f"connections{pairs}.json").write_text(json.dumps(connections(pairs)))
        lines = ["[components]", *(f'{part} = "{kind}.fmu"' for part, kind in parts(pairs).items())]
        lines += ["[run]", f"step = {STEP}", "stop = 10.0"]
        for source, output, target, entry in connections(pairs):
            lines += ["[[connections]]", f'from = "{source}.{output}"', f'to = "{target}.{entry}"']
        (folder / f"system{pairs}.toml").write_text("\n".join(lines) + "\n")


def _description(kind: str) -> str:
    variables, outputs = [], []
    inputs = " ".join(str(k) for k, v in enumerate(_VARIABLES[kind], 1) if v[1] == "input") if kind == "Spring" else ""
    for k, (name, causality, unit, start) in enumerate(_VARIABLES[kind]):
        if causality == "output":
            outputs.append(f'<Unknown index="{k + 1}" dependencies="{inputs}"/>')
        initial = {"output": ' initial="calculated"', "parameter": ' initial="exact"'}.get(causality, "")
        fixed = "fixed" if causality == "parameter" else "continuous"
        value = "" if start is None else f' start="{start}"'
        variables.append(
            f'<ScalarVariable name="{name}" valueReference="{k}" causality="{causality}" variability="{fixed}"{initial}>'
            f'<Real unit="{unit}"{value}/></ScalarVariable>'
        )
    # x follows from x0 at the start, but outputs may name inputs and states only.
    initial_unknowns = "".join(outputs).replace('index="3" dependencies=""', 'index="3" dependencies="6"')
    units = "".join(f'<Unit name="{name}"><BaseUnit {powers}/></Unit>' for name, powers in _UNITS.items())
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="2.0" modelName="{kind}" guid="{{{kind}}}">'
        f'<CoSimulation modelIdentifier="{kind}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"/>'
        f'<UnitDefinitions>{units}</UnitDefinitions><DefaultExperiment startTime="0" stopTime="10" stepSize="{STEP}"/>'
        f"<ModelVariables>{''.join(variables)}</ModelVariables>"
        f"<ModelStructure><Outputs>{''.join(outputs)}</Outputs><InitialUnknowns>{initial_unknowns}</InitialUnknowns></ModelStructure>"
        "</fmiModelDescription>\n"
    )
