"""Write what a model lacks into a copy of its class, as a person would, and check that it arrived."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.compile import compile_class
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.sources import Sources
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import EquationText
from fmus.library import libraries, library_root
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.effects.borders import change_input, change_output
from orchestrator.effects.changes import Change, InputChange, OutputChange, Term, merged
from orchestrator.effects.check import Written, check_changes
from orchestrator.effects.copies import MARK, Copies, Copy, applied
from orchestrator.effects.homes import Home, homes_at, owner_of
from orchestrator.effects.locate import balance_of, written_at
from orchestrator.effects.names import heads, plain, position, renamed, replaced
from orchestrator.effects.points import FlatPoints, points
from orchestrator.effects.text import extended, file_text, in_row, literal, with_terms


def write_back(
    base: ModelicaModel, name: str, changes: Sequence[Change], values: Mapping[str, float], folder: Path | None = None
) -> ModelicaModel:
    """Write a class `name` that is `base` with changes, and compile it.

    Where an equation, an input or an output changes, the class is a copy of the user's with the changed lines marked;
    classes of parts that change are copied, too. Where only parameters change, it extends the user's class. The file
    begins with the user's own text, which stays as it is.

    Args:
        base: the model.
        name: short name of the new class; it stands beside the original, in the same package of the file.
        changes: what is added.
        values: changed parameters of the model by full name, such as `linkage.m[2]`.
        folder: where the file is written, as `name.mo`; None: in the cache.

    Raises:
        ModelicaError: if the text cannot be changed, or if the compiled class is not the original with the changes.
    """
    writer = _Writer(base, name, merged(changes), values)
    text, class_name = writer.text()
    if folder is None:
        folder = cache_folder("patched") / hashlib.sha256(text.encode()).hexdigest()
    file = folder / f"{name}.mo"
    if not file.is_file() or file.read_text() != text:
        write_atomically(file, text.encode())
    model = replace(base, name=name, class_name=class_name, file=file)
    check_changes(writer.system, writer.flat, model.compile(), writer.written, values)
    return model


@dataclass
class _Line:
    """An equation's text with the terms that are added to it."""

    copy: Copy
    text: EquationText
    terms: list[tuple[float, str]] = field(default_factory=list)
    titles: list[str] = field(default_factory=list)


NO_NAMES: Mapping[str, str] = MappingProxyType({})


class _Writer:
    """Collects the copies that some changes need; used once."""

    def __init__(self, base: ModelicaModel, name: str, changes: Sequence[Change], values: Mapping[str, float]) -> None:
        self.base, self.name, self.changes, self.values = base, name, changes, values
        self.system: SymbolicSystem = base.compile()
        self.flat = FlatPoints(compile_class(base.class_name, base.file))
        sources = Sources(base.file, [library_root()], libraries())
        definition = sources.named(tuple(base.class_name.split(".")))
        if definition is None:
            raise ModelicaError(f"the class '{base.class_name}' was not found, so it cannot be changed")
        self.root = View(definition, sources)
        title = changes[0].title if changes else "other values"
        self.copies = Copies(self.root, self.copied_name, title)
        self.written: list[Written] = []
        self._lines: dict[tuple[int, int], _Line] = {}

    @property
    def copied_name(self) -> str:
        """The name of the copied class: the wanted one, unless a class with other values extends it."""
        return self.name if not self._extends else f"{self.name}Plant"

    @property
    def _extends(self) -> bool:
        """Whether values change that the copied class does not declare itself."""
        own = self.root.definition.components
        return not self.changes or any(plain(full) not in own for full in self.values)

    def text(self) -> tuple[str, str]:
        """The whole file, and the full name of the new class."""
        # Inputs first, then outputs: what follows speaks of the plant's own variables, which these rename.
        renames: dict[str, str] = {}
        written: dict[int, Written] = {}
        for k, change in enumerate(self.changes):
            if isinstance(change, InputChange):
                copy, inner = change_input(self.copies, self.root, change, self.system)
                written[k] = Written(change, self._declared_at(copy, change, ""), inner=inner)
                renames[plain(change.input)] = plain(inner)
        of_inputs = dict(renames)
        for k, change in enumerate(self.changes):
            if isinstance(change, OutputChange):
                shown = replace(change, expression=renamed(change.expression, of_inputs))
                copy, inner = change_output(self.copies, self.root, shown, self.system)
                renames[plain(change.output)] = plain(inner)
                names = self._declared_at(copy, change, "", {**of_inputs, plain(change.output): plain(inner)})
                written[k] = Written(change, names, inner=inner)
        for k, change in enumerate(self.changes):
            if isinstance(change, Term):
                written[k] = self._add_term(change, renames)
        self.written = [written[k] for k in range(len(self.changes))]
        for line in self._lines.values():
            _mark(line)
        if self.changes and not self._extends:
            self._change_values()
        wrapper = None
        if self._extends:
            groups = {name: self.elements(name) for name in dict.fromkeys(map(plain, self.values))}
            inner = self._copy_of_root().name if self.changes else self.root.definition.name
            wrapper = extended(self.name, inner, groups, self.root.definition)
        return file_text(self.base, self.root, self.copies, self.name, wrapper)

    def _copy_of_root(self) -> Copy:
        return self.copies.of(homes_at(self.root, ())[0])

    def _add_term(self, term: Term, renames: Mapping[str, str]) -> Written:
        states = [v.name for v in self.system.states]
        balance = balance_of(term, self.flat, states, list(points(self.system, 2)))
        home, texts = written_at(balance, term, self.flat, self.root)
        names, expression = self._supplied(term, home, renames)
        row, rows = balance.row, balance.rows
        if texts[0].iterators:
            row, rows = position(term.state)[-1], 1
        copy = self.copies.of(home)
        for text in texts:
            line = self._lines.setdefault((id(copy), text.span[0]), _Line(copy, text))
            line.terms.append((balance.sign, in_row(expression, row, rows, text.iterators)))
            line.titles.append(term.title)
        return Written(term, names, balance)

    def _supplied(self, term: Term, home: Home, renames: Mapping[str, str]) -> tuple[dict[str, str], str]:
        """Names of a term's parameters and states in the flat model, and the expression in the names of its class.

        What speaks only of variables of a part is declared in the part; else the term is given to the part as an input.
        """
        own = {*term.parameters, *(s.name for s in term.states)}
        used = {h for e in (term.expression, *(s.derivative_expression for s in term.states)) for h in heads(e)} - own
        used -= {"time"}
        path = home.path
        while path and ("[" in ".".join(path) or not all(n.startswith(".".join(path) + ".") for n in used)):
            path = path[:-1]
        prefix = ".".join((*path, ""))
        declaring = self.copies.of(home if path == home.path else self.copies.first_home(path))
        names = self._declared_at(declaring, term, prefix, renames)
        expression = self._local(term.expression, prefix, renames, own)
        for depth in range(len(path), len(home.path)):
            expression = self._handed_down(term, home.path[: depth + 1], expression, home)
        return names, expression

    def _handed_down(self, term: Term, path: tuple[str, ...], expression: str, home: Home) -> str:
        """Give a part an input for a term from outside; its name inside of the part."""
        owner, component = owner_of(self.root, path)
        target = self.copies.of(home if path == home.path else self.copies.first_home(path))
        input_name = _unused("added", target)
        target.declarations.append(f'input Real {input_name} = 0 "{_comment(term.title)}, from outside";  // {MARK}')
        if component.sizes:
            count = len({v.name.split(".")[len(path) - 1] for v in self._with_prefix(path)})
            expression = in_row(expression, position(path[-1])[0], count, ())
        elif position(path[-1]):
            raise ModelicaError(f"'{'.'.join(path)}' is an element of an array that cannot be given a term of its own")
        self.copies.of(owner).part(component.name).modifiers[input_name] = expression
        return input_name

    def _with_prefix(self, path: tuple[str, ...]) -> list[Variable]:
        head = ".".join((*path[:-1], plain(path[-1])))
        everything = (*self.system.states, *self.system.algebraics, *self.system.parameters)
        return [v for v in everything if plain(v.name).startswith(plain(head) + ".")]

    def _local(self, expression: str, prefix: str, renames: Mapping[str, str], own: set[str]) -> str:
        """An expression in the names of the part `prefix`."""
        expression = renamed(expression, {k: v for k, v in renames.items() if k not in own})
        return replaced(expression, lambda name: name.removeprefix(prefix))

    def _declared_at(
        self, copy: Copy, change: Change, prefix: str, renames: Mapping[str, str] = NO_NAMES
    ) -> dict[str, str]:
        """Declare the parameters and states of a change in a class; their flat names."""
        own = {*change.parameters, *(s.name for s in change.states)}
        for name in own:
            if name in copy.definition.components or name in copy.names:
                raise ModelicaError(
                    f"{copy.definition.file}:{copy.definition.line}: '{copy.definition.name}' has a '{name}' already; "
                    f"give the parameter of '{change.title}' another name"
                )
        copy.names |= own
        if own:
            copy.declarations.append(f"// {change.title}, {MARK}")
        for name, parameter in change.parameters.items():
            text = f"parameter Real {name}{_unit(parameter.unit)} = {literal(parameter.value)}"
            description = f' "{_comment(parameter.description)}"' if parameter.description else ""
            copy.declarations.append(f"{text}{description};")
        for state in change.states:
            unit = f'unit="{state.unit}", ' if state.unit else ""
            start = f"start={literal(state.start)}, fixed={'false' if state.begins else 'true'}"
            copy.declarations.append(f'Real {state.name}({unit}{start}) "{_comment(change.title)}";')
            rate = self._local(state.derivative_expression, prefix, renames, own)
            copy.equations.append(f"der({state.name}) = {rate};  // {change.title} {MARK}")
            if state.begins:
                begins = self._local(state.begins, prefix, renames, own)
                copy.equations += ["initial equation", f"{state.name} = {begins};  // {MARK}", "equation"]
        return {name: prefix + name for name in own}

    def _change_values(self) -> None:
        copy = self._copy_of_root()
        for full in dict.fromkeys(plain(name) for name in self.values):
            component = copy.definition.components[full]
            new = literal(self.elements(full))
            if component.value is None:
                copy.part(full)  # no value to replace
                raise ModelicaError(f"'{full}' has no value in {copy.definition.name}; give it one")
            copy.edits.append((*component.value.span, new))
            before = copy.text[slice(*component.value.span)]
            behind = component.clause[1]
            copy.edits.append((behind, behind, f"  /* {full} was {' '.join(before.split())}; adjusted by misfit */"))

    def elements(self, name: str) -> float | dict[str, float]:
        """The values of a parameter, those that do not change included."""
        known = {v.name: v.start or 0.0 for v in self.system.parameters if plain(v.name) == name}
        unknown = [full for full in self.values if plain(full) == name and full not in known]
        if unknown:
            raise ModelicaError(f"{unknown[0]} is no parameter of {self.system.name} that can be given a value")
        known |= {full: value for full, value in self.values.items() if plain(full) == name}
        return known.get(name, known)


def _mark(line: _Line) -> None:
    """Put the changed equation and its comment into the copy."""
    copy, (first, last) = line.copy, line.text.span
    renamed_here = [edit for edit in copy.edits if first <= edit[0] and edit[1] <= last]
    copy.edits = [edit for edit in copy.edits if edit not in renamed_here]
    equation = applied(copy.text, renamed_here, (first, last))
    copy.edits.append((first, last, with_terms(equation, line.terms, copy.definition.file)))
    behind = _semicolon(copy.text, last)
    title = " and ".join(dict.fromkeys(line.titles))
    end = copy.text.find("\n", behind)
    rest = copy.text[behind : end if end >= 0 else len(copy.text)].strip()
    comment = f"  // {title} {MARK}" if not rest or rest.startswith("//") else f"  /* {title} {MARK} */"
    copy.edits.append((behind, behind, comment))


def _semicolon(text: str, place: int) -> int:
    """The place behind the semicolon that ends an equation, which may have a description and an annotation."""
    depth = 0
    for token in tokens_of(text[place:], ""):
        depth += (token.text in ("(", "{", "[")) - (token.text in (")", "}", "]"))
        if token.text == ";" and depth == 0:
            return place + token.end
    return place


def _unused(name: str, copy: Copy) -> str:
    taken = {*copy.definition.components, *copy.names}
    found = next(n for n in (name, *(f"{name}{k}" for k in range(2, 99))) if n not in taken)
    copy.names.add(found)
    return found


def _unit(unit: str) -> str:
    return f'(unit="{unit}")' if unit else ""


def _comment(text: str) -> str:
    return text.replace("\\", "").replace('"', "'")
