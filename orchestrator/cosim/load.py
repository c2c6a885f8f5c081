"""Find the system that a SYSTEM argument names: TOML, SSP, one FMU, or a Modelica class that becomes one."""

import re
from dataclasses import replace
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System

ENDINGS = (".toml", ".ssd", ".ssp", ".fmu")


def load_system(model: str | Path) -> System:
    """Read a system file; a single FMU is a system of one, with the inputs and outputs of the FMU.

    `FILE.mo:Package.Class` and the names of built-in models are built into the cache and read as an FMU.

    Raises:
        MisfitError: if there is no such file or model or it cannot be used; the message names the place in the file.
    """
    path = Path(model)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        if path.exists():
            raise MisfitError(f"{path}: ending {ending!r}; expected a system file ({', '.join(ENDINGS)})")
        return _single(built_fmu(str(model)))
    if not path.is_file():
        raise MisfitError(f"{path} does not exist; expected a system file ({', '.join(ENDINGS)})")
    if ending == ".toml":
        from orchestrator.cosim.toml_file import read_toml

        return _written_out(read_toml(path))
    if ending == ".fmu":
        return _single(path)
    from orchestrator.cosim.ssp import read_ssp

    return read_ssp(path)


def _written_out(system: System) -> System:
    """The same system, connections of terminals as those of their variables, which whoever reads it can deal with."""
    from orchestrator.cosim.fmu import read_description
    from orchestrator.cosim.terminals import variables_of

    def described(name: str) -> object:
        spec = system.components.get(name)
        if spec is None or spec.kind != "fmu":
            return None
        try:
            return read_description(system.folder / spec.source)
        except MisfitError:  # told when the system is checked
            return None

    found: list[Connection] = []
    for connection in system.connections:
        try:
            found += variables_of(connection, described)
        except MisfitError as error:
            raise MisfitError(f"connection {connection.source} -> {connection.target}: {error}") from error
    return replace(system, connections=tuple(found))


def _single(path: Path) -> System:
    from orchestrator.cosim.fmu import read_description

    description = read_description(path)
    name = re.sub(r"\W", "_", path.stem)
    of = {
        causality: {
            p.name: f"{name}.{p.name}" for p in description.ports if p.causality == causality and p.type != "Clock"
        }
        for causality in ("input", "output")
    }
    inputs = {port: (address,) for port, address in of["input"].items()}
    return System(
        path.stem,
        {name: ComponentSpec(name, source=path.name)},
        inputs=inputs,
        outputs=of["output"],
        run=RunSettings(start=description.start_time, stop=description.stop_time),
        folder=path.parent,
    )
