"""What the linter keeps of a Modelica file: classes, declarations and modifications, with their lines."""

from dataclasses import dataclass, field
from pathlib import Path

Name = tuple[str, ...]


@dataclass(slots=True)
class Value:
    """An expression: where it stands, and its shape if it is written as an array constructor."""

    line: int
    length: int | None = None
    text: str = ""


@dataclass(slots=True)
class Modifier:
    """`name(sub...) = value`, or a redeclaration of `name`."""

    name: Name
    line: int
    sub: list["Modifier"] = field(default_factory=list)
    value: Value | None = None
    redeclared: "ClassDef | Component | None" = None


@dataclass(slots=True)
class Component:
    """A declared variable or part."""

    name: str
    line: int
    type_name: Name
    prefixes: frozenset[str]
    sizes: list[str] = field(default_factory=list)
    modifiers: list[Modifier] = field(default_factory=list)
    value: Value | None = None
    constraint: "Extends | None" = None


@dataclass(slots=True)
class Extends:
    """A base class with its modifications; also the constraining class of a replaceable element."""

    type_name: Name
    line: int
    modifiers: list[Modifier] = field(default_factory=list)


@dataclass(slots=True)
class Import:
    """`import A.B`, `import X = A.B`, `import A.*` (alias `*`) or one name of `import A.{B, C}`."""

    name: Name
    alias: str


@dataclass(slots=True, eq=False)
class ClassDef:
    """A class; `short` is the base of `model A = B(...)`, `folder` that of a package stored as a folder."""

    name: str
    kind: str
    line: int
    file: str
    prefixes: frozenset[str] = frozenset()
    short: Extends | None = None
    is_enumeration: bool = False
    within: Name = ()
    outer: "ClassDef | None" = None
    folder: Path | None = None
    classes: dict[str, "ClassDef"] = field(default_factory=dict)
    components: dict[str, Component] = field(default_factory=dict)
    bases: list[Extends] = field(default_factory=list)
    imports: list[Import] = field(default_factory=list)
    constraint: Extends | None = None

    @property
    def all_bases(self) -> list[Extends]:
        """What the class extends, or what it is short for."""
        return [self.short] if self.short is not None else self.bases
