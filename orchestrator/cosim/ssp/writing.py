"""A system as an SSP 1.0 archive, which holds its FMUs; 2.0 only where arrays or the types of FMI 3 need it."""

import zipfile
from io import BytesIO
from pathlib import Path

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.ssp.document import PARAMETERS, Document, to_bytes
from orchestrator.cosim.ssp.files import STRUCTURE
from orchestrator.cosim.system import System


def write_ssp(system: System, path: Path) -> Path:
    """Write a system of FMUs as an SSP; returns the path. The same system gives the same bytes.

    Parameter values are in `resources/parameters.ssv`, in the units of the variables, named `component.variable`.

    Raises:
        MisfitError: if a component is no FMU, the system does not pass its checks, or the file cannot be written.
    """
    others = [name for name, spec in system.components.items() if spec.kind != "fmu"]
    if others:
        raise MisfitError(
            f"system {system.name!r}: {', '.join(others)} cannot be in an SSP, which holds FMUs only; take it out first"
        )
    descriptions = {name: describe(spec, system.folder) for name, spec in system.components.items()}
    wire(system, descriptions)
    ports = {name: {port.name: port for port in each.ports} for name, each in descriptions.items()}
    sources = _resources(system)
    writer = Document(system, ports, sources)
    document = writer.structure()
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        _add(archive, STRUCTURE, document)
        if writer.parameters is not None:
            _add(archive, PARAMETERS, to_bytes(writer.parameters))
        for name, source in dict(zip(sources.values(), system.components.values(), strict=True)).items():
            _add(archive, name, (system.folder / source.source).read_bytes())
    try:
        write_atomically(path, buffer.getvalue())
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error
    return path


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, content)


def _resources(system: System) -> dict[str, str]:
    """Path in the archive of each component's FMU; components with the same file share it."""
    paths: dict[Path, str] = {}
    for spec in system.components.values():
        file = (system.folder / spec.source).resolve()
        if file not in paths:
            name, number = file.name, 1
            while f"resources/{name}" in paths.values():
                number += 1
                name = f"{file.stem}_{number}{file.suffix}"
            paths[file] = f"resources/{name}"
    return {name: paths[(system.folder / spec.source).resolve()] for name, spec in system.components.items()}
