"""A coupled system with further components in it, with all its files in one folder."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from orchestrator.blackbox.exposed import JOINT
from orchestrator.cosim.system import ComponentSpec, Connection, System, split_address


def extended(
    system: System,
    added: Mapping[str, ComponentSpec],
    connections: Sequence[tuple[str, str]],
    inputs: Mapping[str, tuple[str, ...]],
    outputs: Mapping[str, str],
    name: str,
) -> System:
    """The system with components added; of the sums that were put in front of forces only those stay that are used.

    Args:
        system: as `exposed` gives it, with a sum in front of each connected force.
        added: components by name; one of the system's own names gets a number.
        connections: from and to addresses, of added components and of the system's own.
        inputs, outputs: of the new system.
    """
    used = {split_address(target)[0] for _, target in connections}
    idle = {label for label in system.components if label.startswith(JOINT) and label not in used}
    whole = _without(system, idle)
    names = {label: _free(label, whole.components) for label in added}

    def renamed(address: str) -> str:
        component, variable = split_address(address)
        return f"{names.get(component, component)}.{variable}"

    return replace(
        whole,
        name=name,
        components={
            **whole.components,
            **{names[label]: replace(spec, name=names[label]) for label, spec in added.items()},
        },
        connections=(*whole.connections, *(Connection(renamed(a), renamed(b)) for a, b in connections)),
        inputs={
            label: tuple(map(renamed, at))
            for label, at in inputs.items()
            if not split_address(at[0])[0].startswith(JOINT)
        },
        outputs={label: renamed(at) for label, at in outputs.items()},
    )


def beside(system: System, folder: Path) -> System:
    """The system with its files copied to a folder, by names that differ."""
    components, taken = {}, dict[str, Path]()
    for label, spec in system.components.items():
        file = (system.folder / spec.source).resolve()
        if not spec.source or not file.is_file():
            here = (folder / spec.source).resolve() if spec.source else None
            file = here if here is not None and here.is_file() else file
        if not spec.source or not file.is_file():
            components[label] = spec
            continue
        target = folder / file.name
        if taken.get(target.name, file) != file:
            target = folder / f"{label}_{file.name}"
        taken[target.name] = file
        if target.resolve() != file:
            shutil.copyfile(file, target)
        components[label] = replace(spec, source=target.name)
    return replace(system, components=components, folder=folder)


def _without(system: System, idle: set[str]) -> System:
    """The system with each idle sum taken out, and what came into it connected as it was."""
    left, before = [], {}
    for connection in system.connections:
        if split_address(connection.target)[0] in idle:
            before[split_address(connection.target)[0]] = connection
    for connection in system.connections:
        source, target = split_address(connection.source)[0], split_address(connection.target)[0]
        if source in idle:
            left.append(replace(before[source], target=connection.target))
        elif target not in idle:
            left.append(connection)
    components = {label: spec for label, spec in system.components.items() if label not in idle}
    return replace(system, components=components, connections=tuple(left))


def _free(label: str, taken: Mapping[str, object]) -> str:
    number, name = 1, label
    while name in taken:
        number += 1
        name = f"{label}_{number}"
    return name
