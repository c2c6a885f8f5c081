"""Small FMUs of our own, compiled from `fmus/*.c` with a description written here; each is built once for its content."""

import hashlib
import os
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fmus.files import cache_folder
from fmus.runtime.compiler import find_compiler

SOURCES = Path(__file__).parent / "fmus"
PLATFORMS = {2: "linux64", 3: "x86_64-linux"}


@dataclass(frozen=True)
class Var:
    """A variable; its value reference is its place. `depends` are names of inputs, None for all."""

    name: str
    causality: str
    start: str | None = None
    unit: str = ""
    type: str = "Float64"
    variability: str = ""
    depends: tuple[str, ...] | None = ()
    derivative: str = ""
    dimensions: tuple[str, ...] = ()
    attributes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Model:
    """Description of a model file: variables, states (by name, with their rates' names where they are variables)."""

    variables: tuple[Var, ...]
    rates: tuple[str, ...] = ()
    n_indicators: int = 0
    exchange: bool = False
    stepping: bool = True
    abilities: Mapping[str, str] = field(default_factory=dict)
    resources: Mapping[str, bytes] = field(default_factory=dict)


def _inputs(*names: str, unit: str = "") -> tuple[Var, ...]:
    return tuple(Var(name, "input", "0", unit) for name in names)


_MASS = (
    *_inputs("fa", "fb", unit="N"),
    Var("x", "output", unit="m"),
    Var("v", "output", unit="m/s"),
    Var("m", "parameter", "1", "kg"),
    Var("x0", "parameter", "1", "m"),
    Var("der(x)", "local", unit="m/s", derivative="x"),
    Var("der(v)", "local", unit="m/s2", derivative="v", depends=("fa", "fb")),
)
_ENDS = ("x1", "v1", "x2", "v2")
_SPRING = (
    *(Var(name, "input", "0", "m/s" if name[0] == "v" else "m") for name in _ENDS),
    *(Var(name, "output", unit="N", depends=_ENDS) for name in ("f1", "f2")),
    Var("k", "parameter", "10", "N/m"),
    Var("d", "parameter", "0", "N.s/m"),
)
_BALL = (
    Var("h", "output", unit="m", attributes={"reinit": "true"}),
    Var("v", "output", unit="m/s", attributes={"reinit": "true"}),
    Var("g", "parameter", "9.81", "m/s2"),
    Var("e", "parameter", "0.7"),
    Var("v_min", "parameter", "0.1", "m/s"),
    Var("der(h)", "local", unit="m/s", derivative="h"),
    Var("der(v)", "local", unit="m/s2", derivative="v"),
)
_PAIRS = (
    ("float32", "Float32", "0"),
    *((f"{kind.lower()}", kind, "0") for kind in ("Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64")),
)


def _both(name: str, kind: str, start: str) -> tuple[Var, Var]:
    discrete = "" if kind.startswith("Float") else "discrete"
    return (
        Var(f"{name}_in", "input", start, type=kind, variability=discrete),
        Var(f"{name}_out", "output", type=kind, variability=discrete, depends=(f"{name}_in",)),
    )


_FEEDTHROUGH = (
    *_both("float64", "Float64", "0"),
    Var("tunable", "parameter", "0", variability="tunable"),
    Var("tuned", "output"),
    *_both("int32", "Int32", "0"),
    *_both("boolean", "Boolean", "false"),
    *_both("string", "String", "Set me!"),
    *_both("enumeration", "Enumeration", "1"),
)
_STATESPACE = (
    *(Var(name, "structuralParameter", "3", type="UInt64", variability="tunable") for name in "mnr"),
    Var("a", "parameter", "-1 0 0 0 -1 0 0 0 -1", dimensions=("n", "n")),
    Var("b", "parameter", "1 0 0 0 1 0 0 0 1", dimensions=("n", "m")),
    Var("c", "parameter", "1 0 0 0 1 0 0 0 1", dimensions=("r", "n")),
    Var("d", "parameter", "0 0 0 0 0 0 0 0 0", dimensions=("r", "m")),
    Var("x0", "parameter", "0 0 0", dimensions=("n",)),
    Var("u", "input", "1 2 3", dimensions=("m",)),
    Var("y", "output", dimensions=("r",), depends=None),
    Var("x", "local", dimensions=("n",)),
)
MODELS = {
    "mass": Model(_MASS, rates=("der(x)", "der(v)"), exchange=True),
    "spring": Model(_SPRING, exchange=True, abilities={"derivatives": "true"}),
    "gain": Model(
        (
            Var("u", "input", "0"),
            Var("y", "output", depends=("u",)),
            Var("a", "parameter", "0.5"),
            Var("b", "parameter", "1"),
        ),
        exchange=True,
        abilities={"derivatives": "true"},
    ),
    "ball": Model(_BALL, rates=("der(h)", "der(v)"), n_indicators=1, exchange=True),
    "stair": Model((Var("counter", "output", type="Int32", variability="discrete"),), exchange=True),
    "decay": Model(
        (
            Var("x", "output"),
            Var("k", "parameter", "1"),
            Var("u", "input", "0"),
            Var("longest", "parameter", "1e9", "s"),
            Var("der(x)", "local", derivative="x", depends=("u",)),
        ),
        rates=("der(x)",),
        exchange=True,
    ),
    "forgetful": Model(
        (
            Var("x", "output"),
            Var("k", "parameter", "1"),
            Var("u", "input", "0"),
            Var("longest", "parameter", "1e9", "s"),
        )
    ),
    "resource": Model((Var("y", "output", type="Int32", variability="discrete"),), resources={"y.txt": b"a"}),
    "feedthrough": Model(_FEEDTHROUGH),
    "feedthrough3": Model(
        (*_FEEDTHROUGH, *(var for pair in _PAIRS for var in _both(*pair)), *_both("binary", "Binary", "666f6f"))
    ),
    "statespace": Model(_STATESPACE),
}


def small_fmu(
    name: str,
    version: int = 2,
    *,
    interfaces: Sequence[str] = (),
    sources: bool = False,
    platform: str | None = None,
    replace: Mapping[str, str] | None = None,
) -> Path:
    """An FMU of `MODELS`, by default with all interfaces that the model has.

    With `sources` it brings its sources instead of a binary; `platform` is the folder of the binary, and `replace` changes
    the text of the model description.
    """
    model = MODELS["feedthrough3" if name == "feedthrough" and version == 3 else name]
    offered = interfaces or (["CoSimulation"] * model.stepping + ["ModelExchange"] * model.exchange)
    xml = (_xml2 if version == 2 else _xml3)(name, model, offered, sources)
    for old, new in (replace or {}).items():
        assert old in xml, f"{old} is not in the description of {name}"
        xml = xml.replace(old, new)
    texts = [path.read_bytes() for path in sorted(SOURCES.glob("small*"))] + [(SOURCES / f"{name}.c").read_bytes()]
    key = hashlib.sha256(b"\0".join([xml.encode(), repr((version, sources, platform)).encode(), *texts])).hexdigest()
    target = cache_folder("test-fmus") / key[:24] / f"{name}.fmu"
    if not target.is_file():
        target.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            built = Path(folder) / "new.fmu"
            with zipfile.ZipFile(built, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("modelDescription.xml", xml)
                for file, content in model.resources.items():
                    archive.writestr(f"resources/{file}", content)
                if sources:
                    for path in [*SOURCES.glob("small*"), SOURCES / f"{name}.c"]:
                        archive.write(path, f"sources/{path.name}")
                    archive.writestr(
                        "sources/all.c", f'#define FMI {version}\n#define MODEL "{name}.c"\n#include "small.c"\n'
                    )
                    if version == 3:
                        archive.writestr("sources/buildDescription.xml", _BUILD.format(name=name))
                else:
                    binary = _compile(name, version, Path(folder))
                    archive.write(binary, f"binaries/{platform or PLATFORMS[version]}/{name}.so")
            os.replace(built, target)
    return target


_BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="{name}"><SourceFileSet language="C99">
<SourceFile name="all.c"/></SourceFileSet></BuildConfiguration></fmiBuildDescription>"""


def _compile(name: str, version: int, folder: Path) -> Path:
    import fmpy  # type: ignore[import-untyped]

    headers = Path(fmpy.__file__).parent / "c-code"
    command = [*find_compiler(), "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-w", f"-DFMI={version}"]
    command += [
        f'-DMODEL="{name}.c"',
        "-I",
        str(headers),
        "-o",
        str(folder / "binary.so"),
        str(SOURCES / "small.c"),
        "-lm",
    ]
    subprocess.run(command, check=True)
    return folder / "binary.so"


def _variability(var: Var) -> str:
    if var.variability:
        return var.variability
    return "fixed" if "arameter" in var.causality else "continuous"


def _units(model: Model) -> str:
    bases = {
        "m": "1 0 0",
        "m/s": "1 0 -1",
        "m/s2": "1 0 -2",
        "N": "1 1 -2",
        "kg": "0 1 0",
        "N/m": "0 1 -2",
        "N.s/m": "0 1 -1",
        "s": "0 0 1",
    }
    texts = []
    for unit in dict.fromkeys(var.unit for var in model.variables if var.unit):
        m, kg, s = bases[unit].split()
        texts.append(f'<Unit name="{unit}"><BaseUnit m="{m}" kg="{kg}" s="{s}"/></Unit>')
    return f"<UnitDefinitions>{''.join(texts)}</UnitDefinitions>" if texts else ""


def _xml2(name: str, model: Model, offered: Sequence[str], sources: bool) -> str:
    index = {var.name: k + 1 for k, var in enumerate(model.variables)}
    inputs = [var.name for var in model.variables if var.causality == "input"]

    def scalar(k: int, var: Var) -> str:
        kind = {"Float64": "Real", "Int32": "Integer"}.get(var.type, var.type)
        initial = {"parameter": "exact", "output": "calculated", "local": "calculated"}.get(var.causality)
        value = f' start="{var.start}"' if var.start is not None else ""
        value += f' unit="{var.unit}"' if var.unit else ""
        value += f' derivative="{index[var.derivative]}"' if var.derivative else ""
        value += ' declaredType="Choice"' if var.type == "Enumeration" else ""
        value += "".join(f' {key}="{text}"' for key, text in var.attributes.items())
        first = f'name="{var.name}" valueReference="{k}" causality="{var.causality}" variability="{_variability(var)}"'
        first += f' initial="{initial}"' if initial else ""
        return f"<ScalarVariable {first}><{kind}{value}/></ScalarVariable>"

    def unknown(var: Var) -> str:
        depends = inputs if var.depends is None else var.depends
        return f'<Unknown index="{index[var.name]}" dependencies="{" ".join(str(index[d]) for d in depends)}"/>'

    files = '<SourceFiles><File name="all.c"/></SourceFiles>' if sources else ""
    derivatives = 'providesDirectionalDerivative="true"' if model.abilities.get("derivatives") else ""
    common = f'modelIdentifier="{name}" canGetAndSetFMUstate="true" {derivatives}'
    parts = {
        "CoSimulation": f'<CoSimulation {common} canHandleVariableCommunicationStepSize="true">{files}</CoSimulation>',
        "ModelExchange": f"<ModelExchange {common}>{files}</ModelExchange>",
    }
    choice = '<TypeDefinitions><SimpleType name="Choice"><Enumeration><Item name="a" value="1"/><Item name="b" value="2"/></Enumeration></SimpleType></TypeDefinitions>'
    outputs = [var for var in model.variables if var.causality == "output"]
    rates = [var for var in model.variables if var.name in model.rates]
    lists = f"<Outputs>{''.join(map(unknown, outputs))}</Outputs>"
    lists += f"<Derivatives>{''.join(map(unknown, rates))}</Derivatives>" if rates else ""
    lists += f"<InitialUnknowns>{''.join(map(unknown, outputs + rates))}</InitialUnknowns>"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{{{name}}}" generationTool="tests"
 numberOfEventIndicators="{model.n_indicators}">
{"".join(parts[kind] for kind in ("ModelExchange", "CoSimulation") if kind in offered)}
{_units(model)}{choice if any(var.type == "Enumeration" for var in model.variables) else ""}
<DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
<ModelVariables>{"".join(scalar(k, var) for k, var in enumerate(model.variables))}</ModelVariables>
<ModelStructure>{lists}</ModelStructure>
</fmiModelDescription>"""


def _xml3(name: str, model: Model, offered: Sequence[str], sources: bool) -> str:
    number = {var.name: k for k, var in enumerate(model.variables)}
    inputs = [var.name for var in model.variables if var.causality == "input"]
    # An indicator needs a variable; time is one too.
    indicators = [
        f'<Float64 name="z[{k}]" valueReference="{100 + k}" causality="local"/>' for k in range(model.n_indicators)
    ]

    def element(k: int, var: Var) -> str:
        first = f'name="{var.name}" valueReference="{k}" causality="{var.causality}" variability="{_variability(var)}"'
        first += f' unit="{var.unit}"' if var.unit else ""
        first += f' derivative="{number[var.derivative]}"' if var.derivative else ""
        first += ' declaredType="Choice"' if var.type == "Enumeration" else ""
        first += "".join(f' {key}="{text}"' for key, text in var.attributes.items())
        inner = "".join(f'<Dimension valueReference="{number[d]}"/>' for d in var.dimensions)
        if var.start is not None and var.type in ("String", "Binary"):
            inner += f'<Start value="{var.start}"/>'
        elif var.start is not None:
            first += f' start="{var.start}"'
        return f"<{var.type} {first}>{inner}</{var.type}>"

    def unknown(tag: str, var: Var) -> str:
        depends = inputs if var.depends is None else var.depends
        return (
            f'<{tag} valueReference="{number[var.name]}" dependencies="{" ".join(str(number[d]) for d in depends)}"/>'
        )

    derivatives = 'providesDirectionalDerivatives="true"' if model.abilities.get("derivatives") else ""
    common = f'modelIdentifier="{name}" canGetAndSetFMUState="true" {derivatives}'
    parts = {
        "CoSimulation": f'<CoSimulation {common} canHandleVariableCommunicationStepSize="true"/>',
        "ModelExchange": f"<ModelExchange {common}/>",
        "ScheduledExecution": f"<ScheduledExecution {common}/>",
    }
    choice = '<TypeDefinitions><EnumerationType name="Choice"><Item name="a" value="1"/><Item name="b" value="2"/></EnumerationType></TypeDefinitions>'
    lists = "".join(unknown("Output", var) for var in model.variables if var.causality == "output")
    lists += "".join(unknown("ContinuousStateDerivative", var) for var in model.variables if var.name in model.rates)
    lists += "".join(f'<EventIndicator valueReference="{100 + k}"/>' for k in range(model.n_indicators))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{{{name}}}" generationTool="tests">
{"".join(text for kind, text in parts.items() if kind in offered)}
{_units(model)}{choice if any(var.type == "Enumeration" for var in model.variables) else ""}
<DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
<ModelVariables>{"".join(element(k, var) for k, var in enumerate(model.variables))}{"".join(indicators)}</ModelVariables>
<ModelStructure>{lists}</ModelStructure>
</fmiModelDescription>"""
