"""The classes whose text makes up a part of a model: the part's type and what that extends."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Optional

from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import View, base_of, type_of
from fmus.frontend.lint.tree import ClassDef, Component, Extends

Path = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Home:
    """A class of the part `path` (empty: the model itself); `deriving` extends it by `clause`, None if it is the part's
    type."""

    path: Path
    view: View
    deriving: Optional["Home"] = None
    clause: Extends | None = None

    @property
    def definition(self) -> ClassDef:
        """The class."""
        return self.view.definition

    @property
    def key(self) -> tuple[Path, int]:
        """The same for equal parts and classes."""
        return self.path, id(self.definition)


def homes_of(view: View, path: Path, deriving: Home | None = None, clause: Extends | None = None) -> Iterator[Home]:
    """A part's class and all that it extends, nearest first.

    Args:
        view: the class as it is seen from the part.
        path: names of the parts that lead to it.
        deriving: the class that extends it, if that is where one comes from.
        clause: the clause by which it does.
    """
    home = Home(path, view, deriving, clause)
    yield home
    for extends in view.definition.all_bases:
        base = base_of(view, extends)
        if base is not None:
            yield from homes_of(base, path, home, extends)


def homes_at(root: View, path: Path) -> list[Home]:
    """The classes of a part of the model.

    Raises:
        ModelicaError: if the part's class cannot be found, or is redeclared elsewhere.
    """
    if not path:
        return list(homes_of(root, ()))
    owner, component = owner_of(root, path)
    redeclared = owner.view.redeclared.get(component.name)
    found = None if redeclared is not None else type_of(owner.view, component.type_name)
    if found is None or found.definition.short is not None or found.definition.name != component.type_name[-1]:
        raise ModelicaError(
            f"{owner.definition.file}:{component.line}: the class of '{component.name}' is redeclared, renamed or not "
            "found, so its equations cannot be changed; name a class of its own there"
        )
    return list(homes_of(found, path))


def owner_of(root: View, path: Path) -> tuple[Home, Component]:
    """The class that declares the last part of a path, and the declaration.

    Raises:
        ModelicaError: if there is none.
    """
    name = re.sub(r"\[.*", "", path[-1])
    for home in homes_at(root, path[:-1]):
        component = home.definition.components.get(name)
        if component is not None:
            return home, component
    raise ModelicaError(f"'{'.'.join(path)}' is not declared in {root.definition.name}, so its class cannot be changed")


def split(name: str) -> list[str]:
    """Parts of a flat name: `rooms[2].T` gives `rooms[2]` and `T`."""
    return re.findall(r"[^.\[]+(?:\[[^\]]*\])?", name)
