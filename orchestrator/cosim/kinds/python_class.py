"""A user's own Python class as a component."""

from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component
from orchestrator.cosim.kinds.code import Guarded, load_object, told
from orchestrator.cosim.system import ComponentSpec


def open_python(spec: ComponentSpec, folder: Path) -> Component:
    """Make an object of the class that `source` names; `arguments` of the options are passed to it.

    Raises:
        MisfitError: if there is no such class, it is no `Component`, or making an object fails.
    """
    made = load_object(spec.source, folder)
    arguments = spec.options.get("arguments", {})
    if not isinstance(made, type) or not issubclass(made, Component):
        raise MisfitError(f"{spec.source} is no class that extends orchestrator.cosim.Component")
    missing = sorted(getattr(made, "__abstractmethods__", ()))
    if missing:
        raise MisfitError(f"{spec.source} lacks {', '.join(missing)}, which every Component has")
    try:
        component = made(**arguments)
    except Exception as error:  # whatever the user's class raises
        raise MisfitError(f"{spec.source} cannot be made with arguments {arguments}: {told(error)}") from error
    for name in ("ports", "feedthrough"):
        if not hasattr(component, name):
            raise MisfitError(f"{spec.source} has no {name}; set it in the class or in __init__")
    return Guarded(spec.name, component)
