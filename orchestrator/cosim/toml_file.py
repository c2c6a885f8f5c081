"""Systems as TOML, read and written: the short form with one file a component, the long form with a table a component."""

from collections.abc import Iterable
from math import isclose
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.units import SiUnit, si_exponents
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.kinds import OPTIONS, kinds
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, split_address
from orchestrator.cosim.values import value_of
from orchestrator.measurements.toml_values import TomlTable, toml_key, toml_literal, toml_pairs
from orchestrator.measurements.wording import nearest, shown

# A component that is built from Modelica when the file is read, and an FMU from then on.
MODELICA = "modelica"
_SYSTEM = ("name", "components", "connections", "inputs", "outputs", "units", "run")
_COMPONENT = ("kind", "source", "parameters", "units", "step", "isolate")
_CONNECTION = ("from", "to", "factor", "offset", "mapping", "convert")
_RUN = ("start", "stop", "step", "master", "tolerance", "options", "nan")


def read_toml(path: Path) -> System:
    """Read a system; its files are named relative to the folder of the TOML file.

    Raises:
        MisfitError: if the file is no TOML or not a system; the message names file, table, key, value and what was expected.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected a system file") from error
    table = TomlTable.parse(path, content)
    table.check_keys(_SYSTEM)
    components = table.get_table("components")
    if not components.values:
        raise MisfitError(f'{path}: no [components]; expected at least one, such as mass = "Mass.fmu"')
    return System(
        name=table.get_text("name") or path.stem,
        components={name: _component(components, name, path.parent) for name in components.values},
        connections=tuple(_connections(table)),
        inputs=_inputs(table.get_table("inputs")),
        outputs={name: _address(table.get_table("outputs"), name) for name in table.get_table("outputs").values},
        units=table.get_table("units").texts(),
        run=_run(table.get_table("run")),
        folder=path.parent,
    )


def _component(components: TomlTable, name: str, folder: Path) -> ComponentSpec:
    if "." in name or not name:
        raise MisfitError(
            f"{components.where}: the component {shown(name)} has a dot or no name; a dot ends the name in addresses"
        )
    if isinstance(components.values[name], str):
        return ComponentSpec(name, source=components.values[name])
    table = components.get_table(name)
    kind, source, kind_keys = _kind(table)
    if kind == MODELICA:
        kind, source = "fmu", str(_built(table, source, folder))
    own = {key: value for key, value in table.values.items() if key not in (*_COMPONENT, *kind_keys)}
    if kind in OPTIONS:
        table.check_keys((*_COMPONENT, *kind_keys, *OPTIONS[kind]))
    parameters = table.get_table("parameters")
    return ComponentSpec(
        name,
        kind,
        source,
        values={key: value_of(parameters, key) for key in parameters.values},
        units=table.get_table("units").texts(),
        step=table.get_positive("step"),
        isolate=table.get_flag("isolate"),
        options=own,
    )


def _kind(table: TomlTable) -> tuple[str, str, tuple[str, ...]]:
    """Kind and source of a component: `fmu = "Mass.fmu"`, or `kind = "fmu"` with `source = "Mass.fmu"`."""
    if "kind" in table.values:
        kind = table.get_text("kind")
        if kind not in OPTIONS and kind not in (known := [MODELICA, *kinds()]):
            raise MisfitError(f"{table.where}: kind = {shown(kind)}; {nearest(kind, known)}")
        return kind, table.get_text("source"), ()
    # Kinds of other packages are looked for only where none of ours is named, since that takes a while.
    named = [kind for kind in (MODELICA, *OPTIONS) if kind in table.values]
    named = named or [kind for kind in kinds() if kind in table.values]
    if len(named) != 1:
        found = f"both {named[0]} and {named[1]}" if named else "no kind"
        every = ", ".join((MODELICA, *kinds()))
        raise MisfitError(f'{table.where}: {found}; expected one of {every}, such as fmu = "Mass.fmu"')
    return named[0], table.get_text(named[0]), (named[0],)


def _built(table: TomlTable, model: str, folder: Path) -> Path:
    try:
        return built_fmu(model, folder)
    except MisfitError as error:
        raise type(error)(f"{table.where}: {error}") from error


def _connections(table: TomlTable) -> Iterable[Connection]:
    given = table.values.get("connections", [])
    if not isinstance(given, list) or not all(isinstance(each, dict) for each in given):
        raise table.wrong("connections", "tables [[connections]] with from and to")
    for place, each in enumerate(given, 1):
        connection = TomlTable(f"{table.where} [[connections]] {place}", each)
        connection.check_keys(_CONNECTION)
        factor = connection.get_number("factor")
        yield Connection(
            source=_address(connection, "from"),
            target=_address(connection, "to"),
            factor=1.0 if factor is None else factor,
            offset=connection.get_number("offset") or 0.0,
            mapping=_mapping(connection),
            convert=connection.get_flag("convert") is not False,
        )


def _mapping(table: TomlTable) -> tuple[tuple[Any, Any], ...]:
    given = table.values.get("mapping", [])
    if not isinstance(given, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in given):
        raise table.wrong("mapping", "pairs of values, such as [[false, 0], [true, 1]]")
    return tuple((one, other) for one, other in given)


def _inputs(table: TomlTable) -> dict[str, tuple[str, ...]]:
    inputs = {}
    for name, given in table.values.items():
        targets = given if isinstance(given, list) and given else [given]
        inputs[name] = tuple(_address(TomlTable(table.where, {name: target}), name) for target in targets)
    return inputs


def _run(table: TomlTable) -> RunSettings:
    table.check_keys(_RUN)
    return RunSettings(
        start=table.get_number("start"),
        stop=table.get_number("stop"),
        step=table.get_positive("step"),
        master=table.get_text("master") or "ordered",
        tolerance=table.get_positive("tolerance"),
        options=dict(table.get_table("options").values),
        nan=table.get_table("nan").texts(),
    )


def _address(table: TomlTable, key: str) -> str:
    wanted = "an address COMPONENT.VARIABLE"
    if key not in table.values:
        raise MisfitError(f"{table.where}: no {shown(key)}; expected {wanted}")
    text = table.values[key]
    if not isinstance(text, str):
        raise table.wrong(key, wanted)
    try:
        split_address(text)
    except MisfitError as error:
        raise table.wrong(key, wanted) from error
    return text


def write_toml(system: System) -> str:
    """Give the text of a TOML file that reads back as the same system.

    Raises:
        MisfitError: if the system defines a unit in its own way, which TOML has no place for, or holds a value that is
            none of TOML.
    """
    _check_units(system)
    lines = [f"name = {toml_literal(system.name)}", ""]
    run = system.run
    pairs = {"start": run.start, "stop": run.stop, "step": run.step, "master": run.master, "tolerance": run.tolerance}
    lines += [
        "[run]",
        *toml_pairs(
            {
                k: v
                for k, v in {**pairs, "options": dict(run.options), "nan": dict(run.nan)}.items()
                if v not in (None, {})
            }
        ),
    ]
    for name, spec in system.components.items():
        named = {spec.kind: spec.source} if spec.source else {"kind": spec.kind}
        table = {**named, "step": spec.step, "isolate": spec.isolate}
        parameters = {key: {"value": v.value, "unit": v.unit} if v.unit else v.value for key, v in spec.values.items()}
        table = {
            k: v
            for k, v in {**table, **spec.options, "parameters": parameters, "units": dict(spec.units)}.items()
            if v not in (None, "", {})
        }
        lines += ["", f"[components.{toml_key(name)}]", *toml_pairs(table)]
    for title, mapping in (("inputs", system.inputs), ("outputs", system.outputs), ("units", system.units)):
        if mapping:
            lines += ["", f"[{title}]", *toml_pairs(mapping)]
    for connection in system.connections:
        lines += ["", "[[connections]]", *toml_pairs(_connection_table(connection))]
    return "\n".join(lines) + "\n"


def _check_units(system: System) -> None:
    """Raise MisfitError if a unit in use means something else here than its name says: TOML has names only."""
    used = [(unit, system.definitions.get(unit)) for unit in system.units.values()]
    for spec in system.components.values():
        used += [(unit, system.definitions.get(unit)) for unit in spec.units.values()]
        used += [(value.unit, value.si) for value in spec.values.values()]
    for unit, si in used:
        if si is not None and not _means_its_name(unit, si):
            raise MisfitError(f"system {system.name!r} defines the unit {unit!r} in its own way; keep it as SSP")


def _means_its_name(unit: str, si: SiUnit) -> bool:
    try:
        named = si_exponents(unit)
    except MisfitError:
        return False
    alike = isclose(si.factor, named.factor, rel_tol=1e-9) and isclose(si.offset, named.offset, abs_tol=1e-9)
    return alike and si.exponents == named.exponents


def _connection_table(connection: Connection) -> dict[str, Any]:
    table: dict[str, Any] = {"from": connection.source, "to": connection.target}
    if (connection.factor, connection.offset) != (1.0, 0.0):
        table |= {"factor": connection.factor, "offset": connection.offset}
    if connection.mapping:
        table["mapping"] = connection.mapping
    return table if connection.convert else {**table, "convert": False}
