"""Where classes are declared: the user's file, the folders around it, and the library."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from fmus.errors import ModelicaError
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Name

NO_PACKAGES: Mapping[str, Path] = MappingProxyType({})


class Sources:
    """Finds top-level classes and members of packages; files are read when a class in them is asked for."""

    def __init__(self, file: Path | None, roots: list[Path], packages: Mapping[str, Path] = NO_PACKAGES) -> None:
        self._roots, self._libraries = roots, packages
        self._top: dict[str, ClassDef | None] = {}
        self._files: dict[Path, tuple[ClassDef, ...]] = {}
        self._packages: dict[tuple[ClassDef, str], ClassDef | None] = {}
        if file is not None and not (file.parent / "package.mo").exists():
            self._top.update({definition.name: definition for definition in self._read(file)})
        elif file is not None:
            self._roots = [outermost(file.parent).parent, *roots]

    def top(self, name: str) -> ClassDef | None:
        """Return the top-level class of a name."""
        if name not in self._top:
            found = (self._stored(root, name, None) for root in self._roots)
            definition = next((definition for definition in found if definition is not None), None)
            self._top[name] = definition or self._library(name)
        return self._top[name]

    def stored_member(self, package: ClassDef, name: str) -> ClassDef | None:
        """Return the class that a package's folder holds in a file of its own."""
        if package.folder is None:
            return None
        key = (package, name)
        if key not in self._packages:
            self._packages[key] = self._stored(package.folder, name, package)
        return self._packages[key]

    def named(self, name: Name) -> ClassDef | None:
        """Return the class of a full name, if its declaration is plain: nested or stored, not inherited."""
        found = self.top(name[0])
        for part in name[1:]:
            if found is None:
                return None
            found = found.classes.get(part) or self.stored_member(found, part)
        return found

    def files(self) -> list[Path]:
        """List the files that were read so far."""
        return list(self._files)

    def _library(self, name: str) -> ClassDef | None:
        """Top-level class of a library, whose folder may have a version in its name."""
        place = self._libraries.get(name)
        if place is None:
            return None
        path = place if place.suffix == ".mo" else place / "package.mo"
        for definition in self._read(path):
            if definition.name == name:
                definition.folder = place if path != place else None
                return definition
        return None

    def _stored(self, folder: Path, name: str, outer: ClassDef | None) -> ClassDef | None:
        inner = folder / name
        for path in (folder / f"{name}.mo", inner / "package.mo"):
            if path.is_file():
                for definition in self._read(path):
                    if definition.name == name:
                        definition.outer = outer
                        definition.folder = inner if path.parent == inner else None
                        return definition
        return None

    def _read(self, path: Path) -> tuple[ClassDef, ...]:
        if path not in self._files:
            # All packages have a file of one name; the folder tells which.
            shown = f"{path.parent.name}/package.mo" if path.name == "package.mo" else path.name
            self._files[path] = parse(modelica_text(path), shown)
            for definition in self._files[path]:
                definition.path = path
        return self._files[path]


def outermost(folder: Path) -> Path:
    """The folder of the top-level package that a folder belongs to."""
    while (folder.parent / "package.mo").exists():
        folder = folder.parent
    return folder


def modelica_text(path: Path) -> str:
    """Text of a Modelica file.

    Raises:
        ModelicaError: if it is not UTF-8, with the line.
    """
    content = path.read_bytes()
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ModelicaError(
            f"{path.name}:{line}: the byte {content[error.start]:#x} is not UTF-8; save the file in this encoding"
        ) from error


def without_within(text: str) -> str:
    """A Modelica text that may stand behind another one: without the `within ;` that editors put in front.

    Example:
        >>> without_within("within ;\\nmodel M end M;")
        '\\nmodel M end M;'
    """
    first, second = tokens_of(text, "")[:2] if text.strip() else (None, None)
    if first is None or second is None or first.text != "within" or second.text != ";":
        return text
    return text[: first.start] + text[second.end :]
