"""A container put together: table, sources, binaries, descriptions, and the components below its resources."""

import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from fmus.build import SUFFIXES
from fmus.description_parts import build_description
from fmus.errors import FmuError
from fmus.files import write_atomically
from fmus.fmi_version import find_version
from fmus.package import fingerprint, headers, library_files, zipped
from fmus.platforms import Platform
from fmus.runtime.generated import model_identifier
from fmus.trust import is_trusted, trust
from orchestrator.cosim.container.description import TYPES2, Heading, description
from orchestrator.cosim.container.planned import ContainedPart, PlannedSystem, contained_parts, part_files, plan_system
from orchestrator.cosim.container.table import table_code
from orchestrator.cosim.container.variables import Exposed, exposed_variables
from orchestrator.cosim.load import load_system
from orchestrator.cosim.system import System

_NO_GUID = "{00000000-0000-0000-0000-000000000000}"


def build_container(
    model: Path, folder: Path, platforms: Sequence[Platform] = ()
) -> tuple[list[Path], tuple[str, ...]]:
    """Write NAME.fmu (FMI 2.0) and NAME.fmi3.fmu (FMI 3.0) of a system file (TOML, SSD or SSP); see `container_of`.

    Args:
        model: the system file.
        folder: where to write.
        platforms: platforms beside this machine's that it gets libraries for.

    Returns:
        The files, and notes on what the container cannot do.
    """
    return container_of(load_system(model), model.stem, folder, platforms)


def container_of(
    system: System, name: str, folder: Path, platforms: Sequence[Platform] = ()
) -> tuple[list[Path], tuple[str, ...]]:
    """Write a system as one FMU for co-simulation, in all FMI versions.

    Inside, the components exchange values at the communication points of the system, in the order of its master, whatever
    steps the importer takes.

    Args:
        system: as described.
        name: of the files, before their endings.
        folder: where to write; created where missing.
        platforms: what to build binaries for beside this machine.

    Returns:
        The files, and lines about what was assumed or left out.

    Raises:
        MisfitError: naming the component or connection that cannot be in an FMU, or if the system does not fit together.
    """
    with tempfile.TemporaryDirectory(prefix="misfit-container-") as made:
        parts = contained_parts(system, Path(made))
        planned = plan_system(system, parts)
        variables, notes = exposed_variables(planned)
        contents = {f"resources/{name}": data for name, data in part_files(parts, platforms).items()}
        folder.mkdir(parents=True, exist_ok=True)
        files = []
        for version, suffix in SUFFIXES.items():
            path = folder / f"{name}{suffix}"
            seen = [each for each in variables if version != "2.0" or each.port.type in TYPES2]
            _write(_packed(planned, seen, name, version, contents, platforms), path, parts)
            files.append(path)
            notes += [
                f"{each.name} is left out of {path.name}: FMI 2.0 has no type for {each.port.type}"
                for each in variables
                if each not in seen
            ]
    return files, (*planned.wiring.notes, *notes)


def _packed(
    planned: PlannedSystem,
    variables: Sequence[Exposed],
    name: str,
    version: str,
    contents: Mapping[str, bytes],
    platforms: Sequence[Platform],
) -> bytes:
    fmi, number = find_version(version), int(version[0])
    identifier = model_identifier(name)
    sources = {**_runtime(fmi.prefix), **headers(fmi), "system.c": table_code(planned, variables, _NO_GUID)}
    heading = Heading(identifier, "", sorted(file for file in sources if file.endswith(".c")))
    whole = {file: text.encode() for file, text in sources.items()}
    guid = fingerprint({**whole, **contents, "": description(planned, variables, heading, number)})
    heading = Heading(identifier, guid, heading.sources)
    sources["system.c"] = sources["system.c"].replace(_NO_GUID, guid)
    files = {
        "modelDescription.xml": description(planned, variables, heading, number),
        **library_files(fmi, identifier, sources, platforms, shared=set(sources) - {"system.c"}),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        **contents,
    }
    if number == 3:
        files["sources/buildDescription.xml"] = build_description(identifier, heading.sources)
    return zipped(files)


def _runtime(prefix: str) -> dict[str, str]:
    """C files of the runtime: the layer of one FMI version, all that knows no version, and the loop of the co-simulation."""
    models = resources.files("fmus.runtime")
    runtime = resources.files("orchestrator.cosim.container.runtime")
    engine = resources.files("orchestrator.cosim.engine")
    own = {
        each.name: each.read_text("utf-8")
        for each in runtime.iterdir()
        if each.name.endswith((".c", ".h")) and (each.name.startswith(prefix) or not each.name.startswith("fmi"))
    }
    common = [engine / "loop.c", engine / "loop.h", models / f"{prefix}_names.h", models / f"{prefix}_absent.c"]
    own |= {each.name: each.read_text("utf-8") for each in common if each.is_file()}
    return own | {"fmi.h": f'#include "{prefix}_container.h"\n'}


def _write(content: bytes, path: Path, parts: Mapping[str, ContainedPart]) -> None:
    try:
        write_atomically(path, content)
    except OSError as error:
        raise FmuError(f"cannot write {path}: {error.strerror}") from error
    # It is as trustworthy as what it holds.
    if all(part.fmu is None or is_trusted(part.fmu.digest) for part in parts.values()):
        trust(hashlib.sha256(content).hexdigest(), f"built from {path.stem}")
