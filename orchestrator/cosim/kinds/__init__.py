"""Kinds of components by name: those that come along, and those that other packages bring by entry point."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.wording import nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from orchestrator.cosim.connections import HasPorts

GROUP = "misfit.components"
Open = Callable[[ComponentSpec, Path], Component]

_OURS = {
    "fmu": "orchestrator.cosim.fmu:open_fmu",
    "player": "orchestrator.cosim.kinds.player:open_player",
    "function": "orchestrator.cosim.kinds.function:open_function",
    "controller": "orchestrator.cosim.kinds.controller:open_controller",
    "python": "orchestrator.cosim.kinds.function:open_python",
}
# Keys of a component's table that belong to its kind.
OPTIONS = {
    "fmu": ("interface", "early_return", "event_mode", "intermediate_update", "ticks"),
    "player": ("trial", "columns", "interpolation", "start"),
    "function": ("inputs", "outputs", "constants"),
    "controller": ("a", "b", "c", "d", "sample_time", "inputs", "outputs"),
    "python": ("arguments",),
}


def open_component(spec: ComponentSpec, folder: Path) -> Component:
    """Load a component, in a process of its own where it asks for that; files that it names are below `folder`.

    Raises:
        MisfitError: if there is no such kind or what it names cannot be used; the message names the component.
        ComponentError: if loading it fails.
    """
    if spec.isolate:
        from orchestrator.cosim.isolate.component import IsolatedComponent

        # Events are between components, which the contract with a process of its own does not know.
        alone = {"event_mode": False} if spec.kind == "fmu" else {}
        return IsolatedComponent(replace(spec, isolate=False, options={**spec.options, **alone}), folder)
    try:
        return _opener(spec.kind)(spec, folder)
    except MisfitError as error:
        if str(error).startswith(f"component {spec.name!r}"):
            raise
        raise type(error)(f"component {spec.name!r}: {error}") from error


def describe(spec: ComponentSpec, folder: Path) -> "HasPorts":
    """Ports and dependencies of a component; an FMU is described without loading its code, anything else is opened.

    Raises:
        MisfitError: as for `open_component`.
    """
    if spec.kind != "fmu":
        return open_component(spec, folder)
    from orchestrator.cosim.fmu import describe_fmu

    try:
        return describe_fmu(spec, folder)
    except MisfitError as error:
        raise type(error)(f"component {spec.name!r}: {error}") from error


def kinds() -> dict[str, str]:
    """Every kind that can be used, with where it comes from as `module:function`."""
    return {**{entry.name: entry.value for entry in _entry_points()}, **_OURS}


def _opener(kind: str) -> Open:
    if kind in _OURS:  # looking for entry points takes longer
        module, _, name = _OURS[kind].partition(":")
        return getattr(import_module(module), name)
    found = {entry.name: entry for entry in _entry_points()}
    if kind not in found:
        raise MisfitError(f"there is no kind of component {kind!r}; {nearest(kind, kinds())}")
    return found[kind].load()


def _entry_points() -> "Iterable[EntryPoint]":
    # Takes a while to import, and systems of our own kinds have no need of it.
    from importlib.metadata import entry_points

    return entry_points(group=GROUP)
