"""Parser of Modelica files down to declarations and modifications; equations are checked and skipped."""

from functools import lru_cache

from fmus.frontend.lint.statements import Statements
from fmus.frontend.lint.tokens import tokens_of
from fmus.frontend.lint.tree import ClassDef, Component, Extends, Import, Modifier, Name

_KINDS = frozenset(("class", "model", "record", "block", "connector", "type", "package", "function", "operator"))
_BEFORE_KIND = frozenset(("encapsulated", "partial", "expandable", "pure", "impure"))
_VARIABLE_PREFIXES = frozenset(("flow", "stream", "discrete", "parameter", "constant", "input", "output"))
_ELEMENT_PREFIXES = frozenset(("redeclare", "final", "inner", "outer", "replaceable", "each"))


@lru_cache(maxsize=512)
def parse(text: str, file: str) -> tuple[ClassDef, ...]:
    """Return the top-level classes of a Modelica text; `file` is the name used in messages.

    Raises:
        ModelicaError: for a syntax error, as `file:line: what is wrong`.
    """
    return Parser(tokens_of(text, file), file).stored_definition()


class Parser(Statements):
    """Recursive descent over the class level of the grammar."""

    def stored_definition(self) -> tuple[ClassDef, ...]:
        """Parse a whole file."""
        within: Name = ()
        if self.accept("within"):
            within = () if self.text == ";" else self.name()
            self.expect(";")
        found = []
        while self.token.kind != "end":
            self.accept("final")
            if not self._is_class():
                self.refuse(f"a class such as 'model' is expected before '{self.text}'")
            definition = self.class_definition(frozenset(), None)
            definition.within = within
            found.append(definition)
            self.expect(";")
        return tuple(found)

    def _is_class(self) -> bool:
        return self.text in _KINDS or self.text in _BEFORE_KIND

    def class_definition(self, prefixes: frozenset[str], outer: ClassDef | None) -> ClassDef:
        """Parse a class, long or short."""
        line, words, start = self.token.line, set(prefixes), self.token.start
        while self._is_class():
            words.add(self.text)
            self.at += 1
        if not words & _KINDS:
            self.refuse("'model', 'function' or another kind of class is missing here", line)
        kind = next(iter(words & _KINDS - {"operator"}), "operator")
        is_extending = self.accept("extends")
        definition = ClassDef(self.identifier(), kind, line, self.file, frozenset(words), outer=outer)
        definition.name_at = self.tokens[self.at - 1].start
        if is_extending:
            definition.bases.append(Extends((definition.name,), line, self._modifiers()))
        if not is_extending and self.accept("="):
            self._short(definition)
        else:
            self.description()
            definition.header = self.tokens[self.at - 1].end
            self._composition(definition)
        definition.span = (start, self.tokens[self.at - 1].end)
        return definition

    def _short(self, definition: ClassDef) -> None:
        if self.accept("enumeration"):
            definition.is_enumeration = True
            self.annotation()
        elif self.accept("der"):
            self.annotation()
        else:
            while self.text in _VARIABLE_PREFIXES:
                self.at += 1
            line = self.token.line
            type_name = self.name()
            if self.text == "[":
                self.subscripts()
            definition.short = Extends(type_name, line, self._modifiers())
        self.comment()

    def _composition(self, definition: ClassDef) -> None:
        outer, self.equations = self.equations, definition.equations
        is_protected = False
        while self.text != "end":
            initial = self.text == "initial" and self.tokens[self.at + 1].text in ("equation", "algorithm")
            self.at += initial
            if self.text in ("equation", "algorithm"):
                self.at += 1
                if self.tokens[self.at - 1].text == "equation" and not initial and not definition.first_equation:
                    definition.first_equation = self.tokens[self.at - 1].end
                known, keyword = len(self.equations), self.tokens[self.at - 1]
                self.section(keyword.text == "algorithm")
                if initial:
                    del self.equations[known:]
                elif keyword.text == "algorithm":
                    definition.algorithms.append((keyword.start, self.tokens[self.at - 1].end))
            elif self.accept("external"):
                while not self.accept(";"):
                    if self.accept("annotation"):
                        self.annotation()
                    else:
                        self.at += 1
            elif self.accept("annotation"):
                self.annotation()
                self.expect(";")
            elif self.accept("public", "protected"):
                is_protected = self.tokens[self.at - 1].text == "protected"
            else:
                before, start = set(definition.components), self.token.start
                self._element(definition)
                self.expect(";")
                for name in definition.components.keys() - before:
                    component = definition.components[name]
                    component.clause, component.is_protected = (start, self.tokens[self.at - 1].end), is_protected
        self.equations = outer
        self._end(definition)

    def _end(self, definition: ClassDef) -> None:
        self.at += 1
        if self.text in ("if", "for", "when", "while"):
            self.refuse(f"'end {self.text}' closes nothing")
        name = self.identifier()
        if name != definition.name:
            where = self.tokens[self.at - 1].line
            self.refuse(f"'end {name}' closes '{definition.kind} {definition.name}' of line {definition.line}", where)

    def _element(self, definition: ClassDef) -> None:
        if self.token.kind == "end":
            self.refuse(f"'end {definition.name};' of line {definition.line} is missing")
        if self.accept("import"):
            definition.imports.extend(self._imports())
        elif self.text == "extends":
            line = self.token.line
            self.at += 1
            start, name = self.token.start, self.name()
            type_span = (start, self.tokens[self.at - 1].end)
            definition.bases.append(Extends(name, line, self._modifiers(), type_span))
            self.comment()
        else:
            self._declaration(definition)

    def _declaration(self, definition: ClassDef) -> None:
        prefixes = self._prefixes(_ELEMENT_PREFIXES)
        if self._is_class():
            nested = self.class_definition(prefixes, definition)
            nested.constraint = self._constraint()
            definition.classes[nested.name] = nested
        else:
            for component in self._components(prefixes):
                earlier = definition.components.get(component.name)
                if earlier is not None:
                    self.refuse(f"'{component.name}' is declared already in line {earlier.line}", component.line)
                definition.components[component.name] = component
        self.comment()

    def _prefixes(self, allowed: frozenset[str]) -> frozenset[str]:
        found = set()
        while self.text in allowed:
            found.add(self.text)
            self.at += 1
        return frozenset(found)

    def _imports(self) -> list[Import]:
        name = self.name()
        if self.accept("="):
            found = [Import(self.name(), name[0])]
        elif self.accept(".*"):
            found = [Import(name, "*")]
        elif self.accept("."):
            self.expect("{")
            found = []
            while not self.accept("}"):
                part = self.identifier()
                found.append(Import((*name, part), part))
                self.accept(",")
        else:
            found = [Import(name, name[-1])]
        self.comment()
        return found

    def _components(self, prefixes: frozenset[str], only_one: bool = False) -> list[Component]:
        prefixes |= self._prefixes(_VARIABLE_PREFIXES)
        first, type_name = self.token.start, self.name()
        type_span = (first, self.tokens[self.at - 1].end)
        common = self.subscripts() if self.text == "[" else []
        found = []
        while True:
            component = Component(self._declared_name(type_name), self.tokens[self.at - 1].line, type_name, prefixes)
            start = self.tokens[self.at - 1].start
            component.sizes = (self.subscripts() if self.text == "[" else []) + common
            component.modifiers = self._modifiers()
            if self.accept("=", ":="):
                component.value = self.value()
            if not only_one and self.accept("if"):
                self.expression()
            self.comment()
            component.span, component.type_span = (start, self.tokens[self.at - 1].end), type_span
            found.append(component)
            if only_one or not self.accept(","):
                break
        constraint = self._constraint()
        for component in found:
            component.constraint = constraint
        return found

    def _declared_name(self, type_name: Name) -> str:
        if self.token.kind != "name":
            self.refuse(f"a name is missing between '{'.'.join(type_name)}' and '{self.text}'", self._line_before())
        return self.identifier()

    def _line_before(self) -> int:
        return self.tokens[self.at - 1].line

    def _constraint(self) -> Extends | None:
        if not self.accept("constrainedby"):
            return None
        line = self._line_before()
        found = Extends(self.name(), line, self._modifiers())
        self.comment()
        return found

    def _modifiers(self) -> list[Modifier]:
        found: list[Modifier] = []
        if not self.accept("("):
            return found
        while not self.accept(")"):
            found.append(self._modifier())
            if not self.accept(","):
                self.expect(")")
                break
        return found

    def _modifier(self) -> Modifier:
        prefixes = self._prefixes(_ELEMENT_PREFIXES)
        if prefixes & {"redeclare", "replaceable"}:
            return self._redeclaration(prefixes)
        line = self.token.line
        modifier = Modifier(self.name(), line, self._modifiers())
        if self.accept("=", ":="):
            modifier.value = self.value()
        self.description()
        return modifier

    def _redeclaration(self, prefixes: frozenset[str]) -> Modifier:
        line = self.token.line
        redeclared: ClassDef | Component
        if self._is_class():
            redeclared = self.class_definition(prefixes, None)
            redeclared.constraint = self._constraint()
        else:
            redeclared = self._components(prefixes, only_one=True)[0]
        return Modifier((redeclared.name,), line, redeclared=redeclared)
