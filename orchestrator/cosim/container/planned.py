"""What a container holds, and the system as its master would run it, worked out without running a component."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.archive import read_archive
from fmus.errors import FmuError, MisfitError
from fmus.platforms import Platform, cross_compile
from orchestrator.cosim.assembly import initial_order, recorded_values, settings_of
from orchestrator.cosim.component import Port
from orchestrator.cosim.connections import HasPorts, wire
from orchestrator.cosim.fmu.description import (
    CO_SIMULATION,
    MODEL_EXCHANGE,
    FmuDescription,
    Interface,
    read_description,
)
from orchestrator.cosim.fmu.sizes import sized
from orchestrator.cosim.fmu.unpacked import find_binary, platform_folders
from orchestrator.cosim.graph import plan
from orchestrator.cosim.kinds import open_component
from orchestrator.cosim.kinds.controller import LinearController
from orchestrator.cosim.masters import TableMaster, find_master
from orchestrator.cosim.masters.operations import Operation, Schedule
from orchestrator.cosim.system import ComponentSpec, System
from orchestrator.cosim.wiring import Wiring

_KINDS = {"function": "a Python function", "python": "a Python component", "player": "a file of measurements"}


@dataclass(frozen=True)
class ContainedPart:
    """A component: an FMU of co-simulation in a folder of the container's resources, or a controller."""

    name: str
    described: Any  # ports and dependencies: an FmuDescription or a LinearController
    folder: str = ""
    interface: Interface | None = None
    early_return: bool = False

    @property
    def fmu(self) -> FmuDescription | None:
        """The description, where it is an FMU."""
        return self.described if isinstance(self.described, FmuDescription) else None

    @property
    def own_step(self) -> float | None:
        """The only step that it takes, in s."""
        return self.described.own_step if isinstance(self.described, LinearController) else None

    @property
    def variable_step(self) -> bool:
        """Whether it takes steps of any size."""
        return bool((self.interface or self.described).variable_step)

    def references(self, port: Port) -> list[int]:
        """Value references of a port: one, or those of all elements for a controller, which has no arrays."""
        if self.fmu is not None:
            return [self.fmu.by_name[port.name][1]]
        first = 0
        for each in self.described.ports:
            if each.name == port.name:
                break
            first += each.size
        return list(range(first, first + port.size))


def contained_parts(system: System, folder: Path) -> dict[str, ContainedPart]:
    """The components of a system as parts of a container, without running any of them; GP blocks become FMUs in `folder`.

    Raises:
        MisfitError: naming the component that cannot be in an FMU, and why.
    """
    for name, spec in system.components.items():
        if spec.kind not in ("fmu", "controller", "gp"):
            raise MisfitError(
                f"component {name!r} is {_KINDS.get(spec.kind, f'of the kind {spec.kind!r}')}, which cannot be put into an FMU; "
                "one FMU can hold FMUs, Modelica classes, controllers and GP blocks: replace it by one of these, or use misfit run"
            )
    parts: dict[str, ContainedPart] = {}
    folders: dict[str, str] = {}
    for name, spec in system.components.items():
        if spec.kind == "controller":
            parts[name] = ContainedPart(name, open_component(spec, system.folder))
            continue
        path = _written(spec, system.folder, folder) if spec.kind == "gp" else system.folder / spec.source
        parts[name] = _fmu_part(spec, path, folders)
    _refuse_twice(parts)
    return parts


def _fmu_part(spec: ComponentSpec, path: Path, folders: dict[str, str]) -> ContainedPart:
    try:
        description = sized(read_description(path), spec.values)
        wanted = spec.options.get("interface")
        interface = description.interface(wanted)
    except MisfitError as error:
        raise type(error)(f"component {spec.name!r}: {error}") from error
    if interface.kind != CO_SIMULATION:
        words = {MODEL_EXCHANGE: "model exchange"}.get(interface.kind, "scheduled execution")
        why = f"is run by {words}" if wanted else f"offers {words} only"
        raise MisfitError(f"component {spec.name!r}: {path.name} {why}; one FMU can hold FMUs for co-simulation")
    if description.version == 1:
        raise MisfitError(
            f"component {spec.name!r}: {path.name} is of FMI 1.0; one FMU can hold those of FMI 2.0 and 3.0"
        )
    # One folder for each FMU, however many components are made of it.
    place = folders.setdefault(description.digest, f"{len(folders) + 1}_{interface.identifier}")
    return ContainedPart(spec.name, description, place, interface, bool(spec.options.get("early_return")))


def _written(spec: ComponentSpec, system_folder: Path, folder: Path) -> Path:
    """The FMU that a component writes of itself."""
    component, path = open_component(spec, system_folder), folder / f"{spec.name}.fmu"
    try:
        component.write_fmu(path)
    except MisfitError as error:
        raise type(error)(f"component {spec.name!r}: {error}") from error
    finally:
        component.terminate()
    return path


def _refuse_twice(parts: Mapping[str, ContainedPart]) -> None:
    seen: dict[str, str] = {}
    for part in parts.values():
        if part.interface is not None and part.interface.once_per_process:
            other = seen.setdefault(part.folder, part.name)
            if other != part.name:
                raise MisfitError(
                    f"components {other!r} and {part.name!r} are the same FMU, which can be instantiated only once per process"
                )


def part_files(parts: Mapping[str, ContainedPart], platforms: Sequence[Platform]) -> dict[str, bytes]:
    """All files of the FMUs, by their path below `resources`, with binaries for this machine and further platforms.

    Raises:
        FmuError: naming the component that has no binary for a platform, and no sources that could be compiled for it.
    """
    files: dict[str, bytes] = {}
    done: set[str] = set()
    for part in parts.values():
        if part.fmu is None or part.interface is None or part.folder in done:
            continue
        done.add(part.folder)
        try:
            content = read_archive(part.fmu.path)
            content |= dict(_native(part.fmu, part.interface, content))
            for platform in platforms:
                content |= dict(_other(part.fmu, part.interface, content, platform))
        except FmuError as error:
            raise FmuError(f"component {part.name!r}: {error}") from error
        files |= {f"{part.folder}/{name}": data for name, data in content.items()}
    return files


def _native(fmu: FmuDescription, interface: Interface, content: Mapping[str, bytes]) -> Iterator[tuple[str, bytes]]:
    binary = find_binary(fmu, interface)
    places = [f"binaries/{place}/" for place in platform_folders(fmu.version)]
    if not any(
        name.startswith(place) and Path(name).stem == interface.identifier for name in content for place in places
    ):
        yield f"{places[0]}{interface.identifier}{binary.suffix}", binary.read_bytes()


def _other(
    fmu: FmuDescription, interface: Interface, content: Mapping[str, bytes], platform: Platform
) -> Iterator[tuple[str, bytes]]:
    place = platform.folder2 if fmu.version == 2 else platform.name
    name = f"binaries/{place}/{interface.identifier}{platform.ending}"
    if name in content or f"binaries/{platform.name}/{interface.identifier}{platform.ending}" in content:
        return
    sets = interface.sources
    if len(sets) != 1 or sets[0].definitions or sets[0].includes or any("/" in file for file in sets[0].files):
        raise FmuError(f"{fmu.path.name} has no binary for {platform.name}; build it with --platforms {platform.name}")
    texts = {
        path.removeprefix("sources/"): data.decode("utf-8", "replace")
        for path, data in content.items()
        if path.startswith("sources/") and path.count("/") == 1 and path.endswith((".c", ".h"))
    }
    units = [file for file in sets[0].files if file.endswith(".c")]
    yield name, cross_compile(texts, [platform], units)[platform]


def described(parts: Mapping[str, ContainedPart]) -> dict[str, HasPorts]:
    """Ports and dependencies of all components."""
    return {name: part.described for name, part in parts.items()}


# Types by their numbers in system.h; an enumeration is a 64-bit number of FMI 3.
KINDS = {"Float64": 0, "Float32": 1, "Int8": 2, "UInt8": 3, "Int16": 4, "UInt16": 5, "Int32": 6, "UInt32": 7}
KINDS |= {"Enumeration": 8, "Boolean": 9, "String": 10}
NUMBERS = tuple(name for name in KINDS if name != "String")
# What a system can give a value, though no variable of the whole has that type.
GIVEN = KINDS | {"Int64": 8, "UInt64": 11}


@dataclass(frozen=True)
class PlannedSystem:
    """Everything that the table of a container is made of; `step` in s."""

    system: System
    parts: Mapping[str, ContainedPart]
    wiring: Wiring
    feedthrough: Mapping[str, Mapping[str, Sequence[str]]]
    initial: tuple[Operation, ...]
    master: TableMaster
    step: float


def plan_system(system: System, parts: Mapping[str, ContainedPart]) -> PlannedSystem:
    """Check a system and write down what its master does.

    Raises:
        MisfitError: if it does not fit together, or its master or a connection has no counterpart in C.
    """
    if any(policy != "stop" for policy in system.run.nan.values()):
        raise MisfitError(
            "nan of [run] asks to go on with values that are not finite, at which one FMU always stops; leave it out"
        )
    known = described(parts)
    wiring = wire(system, known)
    _refuse_connections(wiring)
    feedthrough = {name: part.described.feedthrough for name, part in parts.items()}
    recorded, _ = recorded_values(wiring, None)
    wanted = dict.fromkeys((slot.component, slot.port.name) for slot, _ in recorded)
    settings = settings_of(system, known, {name: part.own_step for name, part in parts.items()})
    kind = find_master(system.run.master)
    if not issubclass(kind, TableMaster):
        raise MisfitError(
            f"master {kind.name!r} goes back in time, which one FMU does not do; choose ordered, jacobi or gauss_seidel in [run]"
        )
    order = plan(wiring, feedthrough, wanted)
    return PlannedSystem(
        system=system,
        parts=parts,
        wiring=wiring,
        feedthrough=feedthrough,
        initial=Schedule(wiring).evaluation(initial_order(wiring, known, feedthrough, wanted)),
        master=kind(wiring, order, list(system.components), settings),
        step=settings.step,
    )


def _refuse_connections(wiring: Wiring) -> None:
    if wiring.ticking:
        raise MisfitError(
            f"{', '.join(wiring.ticking)}: clocks tick in misfit run, but not in one FMU of the system; say event_mode = false "
            "of the component if it runs without them"
        )
    for link in wiring.links:
        for slot in (link.source, link.target):
            if slot.port.type not in NUMBERS:
                raise MisfitError(
                    f"connection {link.source.address} -> {link.target.address} carries the type {slot.port.type}, "
                    "which one FMU does not pass on between its components; use misfit run"
                )
        if any(isinstance(value, str) for pair in link.transfer.mapping.items() for value in pair):
            raise MisfitError(
                f"connection {link.source.address} -> {link.target.address}: its mapping holds texts, which one FMU does not carry"
            )
