"""Copies of classes with changed text."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.sources import modelica_text
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Component, Span
from orchestrator.effects.homes import Home, homes_at, owner_of

MARK = "added by misfit"


@dataclass
class PartChange:
    """Another class for a part, and more modifiers."""

    new_type: str | None = None
    modifiers: dict[str, str] = field(default_factory=dict)


@dataclass
class Copy:
    """A class with another name and changed text; places are those in the original file."""

    home: Home
    name: str
    text: str
    edits: list[tuple[int, int, str]] = field(default_factory=list)
    parts: dict[str, PartChange] = field(default_factory=dict)
    declarations: list[str] = field(default_factory=list)
    equations: list[str] = field(default_factory=list)
    inner: list["Copy"] = field(default_factory=list)
    replaced: list[tuple[Component, str]] = field(default_factory=list)  # declarations, and what stands in their place
    names: set[str] = field(default_factory=set)  # declared by changes

    @property
    def definition(self) -> ClassDef:
        """The original."""
        return self.home.definition

    def part(self, name: str) -> PartChange:
        """The change of a part that the class declares."""
        return self.parts.setdefault(name, PartChange())

    def rendered(self) -> str:
        """The class as text, without the last semicolon."""
        definition = self.definition
        first, last = definition.span
        name = len(definition.name)
        edits = [
            *self.edits,
            (definition.name_at, definition.name_at + name, self.name),
            (last - name, last, self.name),
        ]
        edits += self._part_edits()
        edits += self._replacements()
        if self.declarations:
            place = _behind_line(self.text, self._end_of_parameters())
            edits.append((place, place, "".join(f"{self.indent}  {line}\n" for line in self.declarations)))
        if self.equations:
            edits.append(self._new_equations())
        for nested in self.inner:
            place = nested.definition.span[1]
            edits.append((place, place, f";\n\n{nested.indent}{nested.rendered()}"))
        return applied(self.text, edits, (first, last))

    @property
    def indent(self) -> str:
        """The white space in front of the class."""
        start = self.text.rfind("\n", 0, self.definition.span[0]) + 1
        found = re.match(r"[ \t]*", self.text[start : self.definition.span[0]])
        return found.group() if found else ""

    def _end_of_parameters(self) -> int:
        components = self.definition.components.values()
        public = [c for c in components if not c.is_protected and "parameter" in c.prefixes]
        return max((c.clause[1] for c in public), default=self.definition.header)

    def _new_equations(self) -> tuple[int, int, str]:
        keywords = ("equation", "initial equation")
        lines = "".join(f"{self.indent}{'' if line in keywords else '  '}{line}\n" for line in self.equations)
        if self.definition.equations:
            last = self.definition.equations[-1].span[1]
            ends = [t for t in tokens_of(self.text[last:], self.definition.file) if t.text == ";"]
            place = self.definition.first_equation if self._in_block() else last + ends[0].end
            place = _behind_line(self.text, place)
            return place, place, lines
        ends_of_elements = [c.clause[1] for c in self.definition.components.values()]
        ends_of_elements += [c.span[1] + 1 for c in self.definition.classes.values()]
        if self.definition.first_equation:
            place = self.definition.first_equation
            return place, place, f"\n{lines.rstrip()}"
        place = _behind_line(self.text, max(ends_of_elements, default=self.definition.header))
        return place, place, f"{self.indent}equation\n{lines}"

    def _in_block(self) -> bool:
        """Whether the last equation stands in a loop or in an if, so that what follows it is inside, too."""
        behind = tokens_of(self.text[self.definition.equations[-1].span[1] : self.definition.span[1]], "")
        words = [token.text for token in behind]
        closing = any(a == "end" and b in ("if", "for", "when") for a, b in zip(words, words[1:], strict=False))
        return closing or "algorithm" in words

    def _replacements(self) -> Iterable[tuple[int, int, str]]:
        for clause in dict.fromkeys(component.clause for component, _ in self.replaced):
            gone = [c for c, _ in self.replaced if c.clause == clause]
            lines = [text for c, text in self.replaced if c.clause == clause]
            together = [c for c in self.definition.components.values() if c.clause == clause]
            if len(gone) == len(together):
                yield (*clause, f"\n{self.indent}  ".join(lines))
                continue
            yield from removals(gone, together)
            yield clause[1], clause[1], "".join(f"\n{self.indent}  {line}" for line in lines)

    def _part_edits(self) -> Iterable[tuple[int, int, str]]:
        for name, change in self.parts.items():
            component = self.definition.components[name]
            text = with_modifiers(self.text[slice(*component.span)], component, change.modifiers)
            together = [c for c in self.definition.components.values() if c.clause == component.clause]
            if change.new_type is None or len(together) == 1:
                if change.modifiers:
                    yield (*component.span, text)
                if change.new_type is not None:
                    yield (*component.type_span, change.new_type)
                continue
            yield from removals([component], together)
            prefix = self.text[component.clause[0] : component.type_span[0]]
            between = self.text[component.type_span[1] : min(c.span[0] for c in together)]
            behind = _behind_line(self.text, component.clause[1])
            yield behind, behind, f"{self.indent}  {prefix}{change.new_type}{between}{text};\n"


def removals(gone: list[Component], together: list[Component]) -> Iterable[tuple[int, int, str]]:
    """Take components out of a declaration of several, of which one stays at least."""
    ordered = sorted(together, key=lambda c: c.span)
    first_kept = next(k for k, c in enumerate(ordered) if c not in gone)
    for k, component in enumerate(ordered):
        if component in gone and k < first_kept:
            yield component.span[0], ordered[k + 1].span[0], ""
        elif component in gone:
            yield ordered[k - 1].span[1], component.span[1], ""


def with_modifiers(text: str, component: Component, modifiers: dict[str, str]) -> str:
    """A declared component with more modifiers.

    Args:
        text: the component as it is declared.
        component: what was read of it.
        modifiers: expression of each modifier by name.
    """
    if not modifiers:
        return text
    added = ", ".join(f"{name}={value}" for name, value in modifiers.items())
    tokens = tokens_of(text, "")
    at, depth = 1, 0
    while tokens[at].text == "[" or depth:
        depth += (tokens[at].text == "[") - (tokens[at].text == "]")
        at += 1
    if tokens[at].text == "(":
        return text[: tokens[at].end] + added + (", " if component.modifiers else "") + text[tokens[at].end :]
    return f"{text[: tokens[at - 1].end]}({added}){text[tokens[at - 1].end :]}"


def applied(text: str, edits: Iterable[tuple[int, int, str]], span: Span | None = None) -> str:
    """A text, or a part of it, with pieces replaced.

    Args:
        text: the text.
        edits: first and last place of each piece, and what stands there from now on.
        span: the part that is wanted; the whole by default.

    Raises:
        ModelicaError: if two pieces overlap.
    """
    first, last = span or (0, len(text))
    found, at = [], first
    # What is inserted where a piece is replaced stands in front of it; insertions at one place keep their order.
    for start, end, new in sorted(edits, key=lambda edit: edit[:2]):
        if start < at:
            raise ModelicaError(
                f"two changes of the same text: {text[start:end][:40]!r}; make them one after the other"
            )
        found += [text[at:start], new]
        at = end
    return "".join([*found, text[at:last]])


def _behind_line(text: str, place: int) -> int:
    """The beginning of the next line if nothing but a comment follows on this one, else the place itself."""
    end = text.find("\n", place)
    rest = text[place:end] if end >= 0 else "-"
    return end + 1 if re.fullmatch(r"\s*(//.*|/\*(?:(?!\*/).)*\*/\s*)?;?\s*(//.*)?", rest) else place


class Copies:
    """The copies that a change needs; what uses a changed class is changed to use its copy."""

    def __init__(self, root: View, name: str, title: str) -> None:
        self.root, self.name, self.title = root, name, title
        self.made: dict[tuple[tuple[str, ...], int], Copy] = {}

    def of(self, home: Home) -> Copy:
        """The copy of one class of one part."""
        if home.key in self.made:
            return self.made[home.key]
        name = self.name if home.deriving is None and not home.path else self._new_name(home.definition.name)
        copy = Copy(home, name, modelica_text(file_of(home.definition)))
        self.made[home.key] = copy
        if home.deriving is not None and home.clause is not None:
            if home.deriving.definition.short is not None:
                raise ModelicaError(
                    f"{home.deriving.definition.file}:{home.deriving.definition.line}: '{home.deriving.definition.name}' is "
                    "a short class; write it as a model that extends its base to change its equations"
                )
            self.of(home.deriving).edits.append((*home.clause.type_span, self._type(copy, home.clause.type_name)))
        elif home.path:
            owner, component = owner_of(self.root, home.path)
            self.of(owner).part(component.name).new_type = self._type(copy, component.type_name)
        return copy

    def _new_name(self, name: str) -> str:
        taken = {copy.name for copy in self.made.values()}
        words = "".join(word[:1].upper() + word[1:] for word in re.findall(r"[A-Za-z0-9]+", self.title))
        first = f"{name}With{words or 'Change'}"
        return next(n for n in (first, *(f"{first}{k}" for k in range(2, 99))) if n not in taken)

    def _type(self, copy: Copy, written: tuple[str, ...]) -> str:
        """How the class that was written `A.B` is called now."""
        if self.is_foreign(copy.definition):
            return copy.name
        return ".".join((*written[:-1], copy.name))

    def is_foreign(self, definition: ClassDef) -> bool:
        """Whether a class stands in another file than the model, or the model's file is part of a library."""
        own = outermost(self.root.definition)
        return outermost(definition) is not own and outermost(definition).path != own.path or is_stored(own)

    def first_home(self, path: tuple[str, ...]) -> Home:
        """The class of a part itself."""
        return homes_at(self.root, path)[0]


def is_stored(definition: ClassDef) -> bool:
    """Whether an outermost class of a file is part of a package that is a folder."""
    return bool(definition.within) or (definition.path is not None and definition.path.name == "package.mo")


def outermost(definition: ClassDef) -> ClassDef:
    """The class that is not nested in another one of its file."""
    while definition.outer is not None and definition.path is None:
        definition = definition.outer
    return definition


def file_of(definition: ClassDef) -> Path:
    """The file of a class."""
    path = outermost(definition).path
    if path is None:
        raise ModelicaError(f"{definition.file}: the file of '{definition.name}' is not known")
    return path
