"""The files of libraries that a class needs: compiling them alone takes a second where a whole library takes half a minute."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache, lru_cache
from itertools import pairwise
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.sources import modelica_text, outermost
from fmus.frontend.lint.tokens import Token, tokens_of
from fmus.library import libraries, library_root, standard_subset

Name = tuple[str, ...]


def library_files(model: str, file: Path | None) -> dict[Name, Path]:
    """The files of libraries, and of the user's own package folder, that a class needs; misfit's own library is left out."""
    packages = {name: place for name, place in libraries().items() if place.parent != library_root()}
    if file is None:
        return {}
    if not (file.parent / "package.mo").exists():
        # A folder of libraries may hold the user's file, too, or the original of what was written back.
        others = {name: place for name, place in packages.items() if name not in _classes_of(file)}
        return needed_files([], file, others) if others else {}
    top = outermost(file.parent)
    return needed_files([tuple(model.split("."))], None, {**packages, model.split(".")[0]: top})


def check_libraries(file: Path) -> None:
    """Make sure that a file's `Modelica.` names can be found.

    Raises:
        ModelicaError: with the first line that uses the library, and how to give it.
    """
    if libraries()["Modelica"] != standard_subset() or (file.parent / "package.mo").exists():
        return
    tokens = tokens_of(modelica_text(file), file.name)
    own = {tokens[k + 1].text for k, token in enumerate(tokens) if token.text == "package"}
    for k, token in enumerate(tokens):
        if token.text == "Modelica" and token.kind == "name" and tokens[k - 1].text != "." and "Modelica" not in own:
            name = ["Modelica"]
            while tokens[k + 1].text == "." and tokens[k + 2].kind == "name":
                k += 2
                name.append(tokens[k].text)
            if len(name) > 1 and not _in_subset(tuple(name)):
                raise ModelicaError(
                    f"{file.name}:{token.line}: {'.'.join(name)} is of the Modelica Standard Library, which is not found; name its "
                    "folder, the one that contains Modelica/package.mo, by --library DIR or in MODELICAPATH"
                )


def _in_subset(name: Name) -> bool:
    """Whether a full name, or a package on its way, stands in the subset of the Standard Library that is part of misfit."""
    return all(part in _names_of_the_subset() for part in name)


@cache
def _names_of_the_subset() -> frozenset[str]:
    files = sorted(standard_subset().glob("*.mo"))
    tokens = [token for file in files for token in tokens_of(file.read_text(), file.name)]
    named = (
        "package",
        "type",
        "function",
        "connector",
        "Real",
        "Velocity",
        "Acceleration",
        "ElectricCharge",
        "Temperature",
    )
    return frozenset(b.text for a, b in pairwise(tokens) if a.text in named)


def needed_files(names: list[Name], start: Path | None, packages: Mapping[str, Path]) -> dict[Name, Path]:
    """Follow every dotted name from a file to the files that store it.

    Names are looked up in the enclosing packages from the inside out, as Modelica does; a name that turns out to be a variable
    adds a file that is not needed, and nothing else.

    Args:
        names: full names of classes to begin with.
        start: a file outside of the libraries to begin with; None: no file.
        packages: folder or file of each top-level class of the libraries.

    Returns:
        The file of each stored class by its full name.
    """
    found: dict[Name, Path] = {}
    stack: list[tuple[Name, Path | None]] = [((), start)]
    while stack:
        home, path = stack.pop()
        for reference in names if path is None else [*names, *_references(path)]:
            for name, stored in _stored_along(home, reference, packages):
                if name not in found:
                    found[name] = stored
                    stack.append((name, stored))
    return found


def _stored_along(home: Name, reference: Name, packages: Mapping[str, Path]) -> Iterator[tuple[Name, Path]]:
    """Files on the way to what a name means inside of a class, from the outermost package on."""
    for depth in range(len(home), -1, -1):
        full = (*home[:depth], *reference)
        if _stored(full[: depth + 1], packages) is not None:
            for length in range(1, len(full) + 1):
                stored = _stored(full[:length], packages)
                if stored is None:
                    return
                yield full[:length], stored
            return


def _stored(name: Name, packages: Mapping[str, Path]) -> Path | None:
    """The file that a class has for itself, or the `package.mo` of its folder; None if it is nested in another one's file."""
    folder = packages.get(name[0])
    if folder is None:
        return None
    return _inside(folder, name[1:])


@lru_cache(maxsize=100_000)
def _inside(folder: Path, parts: Name) -> Path | None:
    if folder.suffix == ".mo" and folder.is_file():
        return folder if not parts else None
    inner = folder.joinpath(*parts)
    if (inner / "package.mo").is_file():
        return inner / "package.mo"
    alone = inner.with_name(f"{inner.name}.mo")
    return alone if parts and alone.is_file() else None


def _classes_of(file: Path) -> set[str]:
    """Names of a file's own classes; none of a file with an error, which the linter tells."""
    with suppress(ModelicaError):
        return {definition.name for definition in parse(modelica_text(file), file.name)}
    return set()


def _references(path: Path) -> list[Name]:
    return list(_references_in(path, path.stat().st_mtime_ns))


@lru_cache(maxsize=4096)
def _references_in(path: Path, _: int) -> tuple[Name, ...]:
    try:
        tokens = tokens_of(modelica_text(path), path.name)
    except ModelicaError:
        return ()
    found: dict[Name, None] = {}
    imported: dict[str, set[Name]] = {}
    at = 0
    while tokens[at].kind != "end":
        if tokens[at].text == "annotation" and tokens[at].kind == "keyword":
            at = _behind_annotation(tokens, at + 1)
        elif tokens[at].text == "import" and tokens[at].kind == "keyword":
            at = _behind_import(tokens, at + 1, imported)
        elif tokens[at].kind == "name" and (at == 0 or tokens[at - 1].text != "."):
            parts = [tokens[at].text]
            while tokens[at + 1].text == "." and tokens[at + 2].kind == "name":
                at += 2
                parts.append(tokens[at].text)
            found[tuple(parts)] = None
            at += 1
        else:
            at += 1
    by_import = {(*full, *name[1:]) for name in found for full in imported.get(name[0], ())}
    everything = {(*package, *name) for name in found for package in imported.get("*", ())}
    plain = {full for names in imported.values() for full in names}
    return tuple(dict.fromkeys([*found, *sorted(by_import | everything | plain)]))


def _behind_import(tokens: list[Token], at: int, imported: dict[str, set[Name]]) -> int:
    """Note what names an import gives to classes: `A.B`, `X = A.B`, `A.{B, C}`, or all of `A.*` under `*`."""
    words: list[str] = []
    while tokens[at].text != ";" and tokens[at].kind not in ("end", "string"):
        words.append(tokens[at].text)
        at += 1
    alias, path = (words[0], words[2:]) if words[1:2] == ["="] else (words[-1], words)
    names = [word for word in path if word.isidentifier()]
    if "{" in path:
        package = tuple(word for word in path[: path.index("{")] if word.isidentifier())
        for word in names[len(package) :]:
            imported.setdefault(word, set()).add((*package, word))
    elif names:
        imported.setdefault(alias.removeprefix("."), set()).add(tuple(names))
    return at


def _behind_annotation(tokens: list[Token], at: int) -> int:
    """Annotations name no classes, but for those of derivatives of functions, which the front end looks up."""
    depth = 0
    while tokens[at].kind != "end":
        if tokens[at].text in ("derivative", "inverse", "choicesAllMatching") and depth == 1:
            return at
        depth += (tokens[at].text == "(") - (tokens[at].text == ")")
        at += 1
        if depth == 0:
            break
    return at
