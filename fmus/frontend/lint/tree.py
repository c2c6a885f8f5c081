"""What the linter keeps of a Modelica file: classes, declarations and modifications, with their lines."""

from dataclasses import dataclass, field
from pathlib import Path

Name = tuple[str, ...]
Span = tuple[int, int]


@dataclass(slots=True)
class Value:
    """An expression: where it stands, and its shape if it is written as an array constructor."""

    line: int
    length: int | None = None
    text: str = ""
    span: Span = (0, 0)


@dataclass(slots=True)
class Modifier:
    """`name(sub...) = value`, or a redeclaration of `name`."""

    name: Name
    line: int
    sub: list["Modifier"] = field(default_factory=list)
    value: Value | None = None
    redeclared: "ClassDef | Component | None" = None


@dataclass(frozen=True, slots=True)
class EquationText:
    """An equation as it is written: its characters without description, and its line.

    `iterators` are those of the loops around it, `branches` tells where the if-equations around it begin.
    """

    span: Span
    line: int
    iterators: tuple[str, ...] = ()
    branches: tuple[int, ...] = ()


@dataclass(slots=True)
class Component:
    """A declared variable or part.

    `span` holds the characters from its name to its description or annotation, `type_span` those of its type, and `clause`
    those of the whole declaration, which may declare others, too.
    """

    name: str
    line: int
    type_name: Name
    prefixes: frozenset[str]
    sizes: list[str] = field(default_factory=list)
    modifiers: list[Modifier] = field(default_factory=list)
    value: Value | None = None
    constraint: "Extends | None" = None
    span: Span = (0, 0)
    type_span: Span = (0, 0)
    clause: Span = (0, 0)
    is_protected: bool = False


@dataclass(slots=True)
class Extends:
    """A base class with its modifications; also the constraining class of a replaceable element."""

    type_name: Name
    line: int
    modifiers: list[Modifier] = field(default_factory=list)
    type_span: Span = (0, 0)


@dataclass(slots=True)
class Import:
    """`import A.B`, `import X = A.B`, `import A.*` (alias `*`) or one name of `import A.{B, C}`."""

    name: Name
    alias: str


@dataclass(slots=True, eq=False)
class ClassDef:
    """A class; `short` is the base of `model A = B(...)`, `folder` that of a package stored as a folder.

    `path` is its file where it is the outermost class there. `span` holds its characters up to `end NAME`; `name_at` is where
    its name stands, `header` ends behind its description, `first_equation` behind the first keyword `equation` (0: none).
    `algorithms` are the sections that begin with this keyword.
    """

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
    path: Path | None = None
    classes: dict[str, "ClassDef"] = field(default_factory=dict)
    components: dict[str, Component] = field(default_factory=dict)
    bases: list[Extends] = field(default_factory=list)
    imports: list[Import] = field(default_factory=list)
    constraint: Extends | None = None
    span: Span = (0, 0)
    name_at: int = 0
    header: int = 0
    first_equation: int = 0
    equations: list[EquationText] = field(default_factory=list)
    algorithms: list[Span] = field(default_factory=list)

    @property
    def all_bases(self) -> list[Extends]:
        """What the class extends, or what it is short for."""
        return [self.short] if self.short is not None else self.bases
