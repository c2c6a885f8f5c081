"""The kinds of robots by name; a bench file may also name a user's own as `module:Class`."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from fmus.errors import MisfitError
from hil.robots.base import RobotKind

PROFICIO = "proficio"
# Where each is made from the keys of its bench file; imported when it is needed.
_KINDS = {PROFICIO: "hil.barrett.kind:Proficio", "cia402": "hil.cia402.kind:Drives"}


def robot_kind(name: str, options: Mapping[str, Any]) -> RobotKind:
    """The kind of that name, made with the keys of `[robot]` that are its own.

    Raises:
        MisfitError: if there is none of that name, or the keys do not fit.
    """
    module, _, attribute = _KINDS.get(name, name).partition(":")
    if not attribute:
        raise MisfitError(
            f"robot kind {name!r} is not known; there are {', '.join(_KINDS)}, or `module:Class` of your own"
        )
    try:
        made = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise MisfitError(f"robot kind {name!r} cannot be imported: {error}; write module:Class") from error
    try:
        kind: RobotKind = made(**options)
    except TypeError as error:
        raise MisfitError(f"[robot] of kind {name!r}: {error}") from error
    return kind
