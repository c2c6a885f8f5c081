"""An FMU in model exchange with laws at the rates of its states: the original's library with a small one in front (front.c)."""

import hashlib
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import casadi as ca

from fmus.archive import read_archive
from fmus.children import run_tool
from fmus.errors import MisfitError
from fmus.files import write_atomically
from fmus.package import zipped
from fmus.runtime.compiler import find_compiler, first_error
from orchestrator.blackbox.ports import Description, Port
from orchestrator.blackbox.source import FmuSource
from orchestrator.greybox.around import Placed
from orchestrator.greybox.expression import evaluate
from orchestrator.greybox.places import coordinate
from orchestrator.greybox.tape import Outline

FRONT = Path(__file__).with_name("front.c")
FOLDERS = {2: "linux64", 3: "x86_64-linux"}
CALLS = {2: ("fmi2GetDerivatives", "fmi2GetReal"), 3: ("fmi3GetContinuousStateDerivatives", "fmi3GetFloat64")}
VARIABLE = {
    2: '<ScalarVariable name="{name}" valueReference="{number}" causality="local" variability="constant" initial="exact" '
    'description="{words}"><Real start="{value!r}"/></ScalarVariable>',
    3: '<Float64 name="{name}" valueReference="{number}" causality="local" variability="constant" initial="exact" '
    'description="{words}" start="{value!r}"/>',
}


def write_with_laws(source: FmuSource, seen: Outline, effects: Sequence[Placed], path: Path) -> Path:
    """Write an FMU that is the original with laws at its rates; values of the laws are constants of it, such as `loss1.G`.

    It runs on this kind of machine alone, in model exchange alone, and offers no directional derivatives.

    Args:
        source: the original FMU.
        seen: its balances and the inputs that act there.
        effects: the laws, each with its place and values.
        path: the file to write.

    Raises:
        MisfitError: if a law has memory or depends on time, or the FMU has no library for Linux on x86-64.
    """
    description = source.fmu.description
    entries = read_archive(source.file)
    xml = entries["modelDescription.xml"].decode("utf-8")
    folder = f"binaries/{FOLDERS[description.version]}/"
    identifier = re.search(r"<ModelExchange\b[^>]*?\bmodelIdentifier\s*=\s*[\"']([^\"']+)", xml)
    library = f"{folder}{identifier[1] if identifier else ''}.so"
    if library not in entries:
        raise MisfitError(
            f"{source.file.name} has no {library}; laws at its rates can be written for this platform only"
        )
    plain = entries[library]
    inner = f"original_{hashlib.sha256(plain).hexdigest()[:16]}.so"
    numbers = [int(number) for number in re.findall(r'\bvalueReference\s*=\s*["\'](\d+)', xml)]
    constants = [(f"{e.law.id}{k}.{n}", v) for k, e in enumerate(effects, 1) for n, v in e.values.items()]
    own = {max(numbers) + 1 + k: value for k, (_, value) in enumerate(constants)}
    header = _header(description, seen, effects, inner, own)
    kept = {name: data for name, data in entries.items() if not name.startswith(("binaries/", "sources/"))}
    more = {n: data for n, data in entries.items() if n.startswith(folder) and n != library}
    words = [e.law.title_at(e.place.unit) + f" at {e.place.site}" for e in effects for _ in e.values]
    xml = _described(xml, description.version, constants, list(own), words)
    made = {
        **kept,
        **more,
        library: _compiled(header, inner),
        folder + inner: plain,
        "modelDescription.xml": xml.encode(),
    }
    write_atomically(path, zipped(made))
    return path


def _header(
    description: Description, seen: Outline, effects: Sequence[Placed], inner: str, own: dict[int, float]
) -> str:
    """What front.c needs to know: names, references, constants, and the law as C."""
    sensed: tuple[Port, ...] = (*description.states, *description.inputs)
    symbols = ca.SX.sym("s", len(sensed))
    known = {port.name: symbols[k] for k, port in enumerate(sensed)}
    state_of = {balance.input: balance.state for balance in seen.balances}
    names = [port.name for port in description.states]
    rates = [ca.SX(0)] * len(names)
    for effect in effects:
        used = f"{effect.law.expression} "
        if effect.law.states or re.search(r"\bt\b", used):
            raise MisfitError(
                f"{effect.law.id} at {effect.place.site} cannot be written into an FMU: it has a memory or depends on time"
            )
        at = {
            k: coordinate(text, known) for k, text in effect.place.coordinates.items() if re.search(rf"\b{k}\b", used)
        }
        value = evaluate(effect.law.expression, {**at, **effect.values})
        if any(seen.acting[force] for force in effect.place.adds):
            raise MisfitError(
                f"{effect.law.id} at {effect.place.site} acts on an input's side and on a rate, which cannot be written"
            )
        for force, factor in effect.place.adds.items():
            k = names.index(state_of[force])
            rates[k] = rates[k] + factor * value
    law = ca.Function("law", [symbols], [ca.densify(ca.vertcat(*rates))])
    generator = ca.CodeGenerator("law.c", {"with_header": False})
    generator.add(law)
    call, get = CALLS[description.version]
    listed: dict[str, Sequence[object]] = {
        "SENSED": [port.reference for port in sensed],
        "RATES": [port.reference for port in description.rates],
        "CONSTANT_REFERENCES": list(own),
        "CONSTANTS": [repr(value) for value in own.values()],
    }
    lines = [f"#define FMI {description.version}", f'#define ORIGINAL "{inner}"']
    lines += [f"#define RATES_CALL {call}", f'#define RATES_NAME "{call}"']
    lines += [f"#define GET_CALL {get}", f'#define GET_NAME "{get}"']
    sizes = {"ARG": law.sz_arg(), "RES": law.sz_res(), "IW": law.sz_iw(), "W": law.sz_w()}
    lines += [f"#define law_SZ_{name} {size}" for name, size in sizes.items()]
    lines += [f"#define {name} {{{', '.join(map(str, values))}}}" for name, values in listed.items()]
    return "\n".join([*lines, generator.dump()])


def _described(
    xml: str, version: int, constants: Sequence[tuple[str, float]], numbers: list[int], words: list[str]
) -> str:
    """The model description with the values of the laws, for model exchange alone and without what the laws change."""
    xml = re.sub(r"<(CoSimulation|ScheduledExecution)\b[^>]*?(/>|>.*?</\1>)", "", xml, flags=re.DOTALL)
    xml = re.sub(r'(provides(?:Directional|Adjoint)Derivatives?\s*=\s*)"(?:true|1)"', r'\1"false"', xml)
    entries = [
        VARIABLE[version].format(name=escape(name), number=number, value=value, words=escape(text, {'"': "&quot;"}))
        for (name, value), number, text in zip(constants, numbers, words, strict=True)
    ]
    return xml.replace("</ModelVariables>", "\n".join([*entries, "</ModelVariables>"]), 1)


def _compiled(header: str, inner: str) -> bytes:
    """The library in front, which names the original beside it as one that it needs."""
    with tempfile.TemporaryDirectory(prefix="misfit-front-") as folder:
        place = Path(folder)
        (place / "law.h").write_text(header)
        (place / "front.c").write_text(FRONT.read_text())
        (place / "none.c").write_text("")
        flags = [*find_compiler(), "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off"]
        for command in (
            [*flags, "none.c", "-o", inner, f"-Wl,-soname,{inner}"],
            [*flags, "front.c", "-o", "front.so", "-Wl,--no-as-needed", inner, "-Wl,-rpath,$ORIGIN", "-lm", "-ldl"],
        ):
            done = run_tool(command, folder=place)
            if done.returncode != 0:
                raise MisfitError(f"{command[0]} cannot compile the law: {first_error(done.stderr)}")
        return (place / "front.so").read_bytes()
