"""How results show themselves in a notebook: a result asks here, and the report has registered what draws its kind."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Shown:
    """A picture that a notebook shows when it is the last value of a cell; `html` is its markup."""

    html: str

    def _repr_html_(self) -> str:
        return self.html


@dataclass(frozen=True)
class Drawing:
    """What draws one kind of result: its markup in a cell, and its picture."""

    html: Callable[[Any], str]
    plot: Callable[..., Shown]


_DRAWINGS: dict[str, Drawing] = {}
_LOADERS: list[Callable[[], None]] = []


def register(kind: str, html: Callable[[Any], str], plot: Callable[..., Shown]) -> None:
    """Say what draws a kind of result."""
    _DRAWINGS[kind] = Drawing(html, plot)


def drawn_by(load: Callable[[], None]) -> None:
    """Name what registers the drawings; it is called when the first result is shown, since drawing takes long to import."""
    _LOADERS.append(load)


def drawing_of(kind: str) -> Drawing:
    """What draws a kind of result, such as "comparison"."""
    while kind not in _DRAWINGS and _LOADERS:
        _LOADERS.pop()()
    return _DRAWINGS[kind]
