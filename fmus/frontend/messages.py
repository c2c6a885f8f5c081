"""The compiler's reasons in one line that begins with file and line."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.scope import BUILT_IN, View, type_of
from fmus.frontend.lint.sizes import wrong_sizes
from fmus.frontend.lint.sources import NO_PACKAGES, Sources, modelica_text
from fmus.frontend.lint.tokens import Token, tokens_of

_PLACE = re.compile(r"\[?(?:[^\s\[\]]*/)?(?P<file>[\w.-]+\.mo):(?P<line>\d+):\d+\]?")
_STAGE = re.compile(r"^\w+ failed: \S+ failed in \w+: |^\S+ could not be compiled: ")
_QUOTED = re.compile(r"['`]([A-Za-z_][\w.]*)['`]")
_COUNTS = re.compile(r"unbalanced model: (\d+) equations, (\d+) unknowns")
# What the compiler calls things that a user has never heard of.
_WORDS = {
    "`derivative expression`": "der() of an expression is not supported; declare a variable that equals it, and use its der()",
    "unsupported model algorithm": "an algorithm that reads a variable after it assigned it is not supported; write one "
    "expression for it, such as y = if u > high then high else u",
    "dynamic quotient semantics": "div, mod and rem of variables are not supported in an equation; write floor(a/b), or a - floor(a/b)*b",
    "selected redeclare class has no such member": "the connector has no such variable; of an expandable connector declare all "
    "variables, without 'expandable'",
    "expected Real, found Integer": "whole numbers stand where Reals have to, such as {1, 0, 0} as an argument of cross(); write "
    "{1.0, 0.0, 0.0}",
    "`spatialDistribution`": "spatialDistribution is not supported; write the pipe as several volumes in a row",
    "expression shape mismatch": "the sizes of arrays in an equation or a value do not fit each other, or a scalar stands "
    "where an array has to; compare both sides element by element",
}


def explained(
    message: str, model: str, source: Path, roots: list[Path], packages: Mapping[str, Path] = NO_PACKAGES
) -> str:
    """Turn the compiler's message into `file:line: reasons`.

    Args:
        message: what the compiler printed.
        model: full name of the class that was compiled.
        source: the file given to the compiler.
        roots: folders of the libraries.
        packages: folders or files of further top-level classes, by name.
    """
    text = _reasons(message.replace(f"{source.parent}/", ""))
    place = _PLACE.search(text)
    if place is not None:
        return f"{place['file']}:{place['line']}: {_PLACE.sub('', text).replace(' ;', ';').strip(' ;')}"
    sources = Sources(source, roots, packages)
    if "unbalanced" in text or "shape mismatch" in text:
        better = next(wrong_sizes(model, sources), None)
        better = better or next(_shared(source, sources) if "unbalanced" in text else iter(()), None)
        if better is not None:
            return better
    named = next(_statements(text, source), None) or next(_mentions(text, model, source, sources), None)
    has_flows = any(token.text == "connect" for token in _tokens(source))
    return f"{named or _declaration(model, source, sources)}: {_friendlier(text, has_flows)}"


def _shared(source: Path, sources: Sources) -> Iterator[str]:
    """Bare variables shared by `outer`, which the compiler does not count as it should; it shares components."""
    stack = list(parse(modelica_text(source), source.name))
    while stack:
        definition = stack.pop()
        stack += definition.classes.values()
        for component in definition.components.values():
            shared = type_of(View(definition, sources), component.type_name) if "outer" in component.prefixes else None
            if shared is not None and shared.definition.name in BUILT_IN:
                name, kind = component.name, shared.definition.name
                yield (
                    f"{source.name}:{component.line}: a single variable that is shared by inner and outer is not supported; share a "
                    f"component that has it: 'model World {kind} {name}; end World;', 'inner World world', 'outer World world' and world.{name}"
                )


def _reasons(message: str) -> str:
    """The compiler's reasons in one line, each once."""
    reasons: list[str] = []
    for line in message.splitlines():
        reason = _STAGE.sub("", re.sub(r"^- \S+ \[\w+\]: ", "", line.strip())).split("; missing source context")[0]
        known = any(reason in other for other in reasons)
        if reason and not known and not reason.startswith("Related failures"):
            reasons.append(reason)
    return "; ".join(reasons)[:400] or "the Modelica compiler gave no reason"


def _friendlier(text: str, has_flows: bool) -> str:
    for key, words in _WORDS.items():
        if key in text:
            return words
    counts = _COUNTS.search(text)
    if counts is None:
        return text
    equations, unknowns = int(counts[1]), int(counts[2])
    advice = f"add {unknowns - equations}" if unknowns > equations else f"remove {equations - unknowns}"
    if equations > unknowns and has_flows:
        advice += "; the flow of a connector that nothing is connected to is zero without an equation"
    return f"unbalanced model: {equations} equations for {unknowns} unknowns; {advice}"


def _declaration(model: str, source: Path, sources: Sources) -> str:
    definition = sources.named(tuple(model.split(".")))
    return source.name if definition is None else f"{definition.file}:{definition.line}"


def _statements(text: str, source: Path) -> Iterator[str]:
    """Where the user's file has the kind of statement that a message is about."""
    tokens = _tokens(source)
    texts = [token.text for token in tokens]
    for k, word in enumerate(texts):
        if word == "connect" and text.startswith("connect argument"):
            arguments = "".join(texts[k + 2 : texts.index(")", k)]).split(",") if ")" in texts[k:] else []
            if set(arguments) & set(_QUOTED.findall(text)):
                yield f"{source.name}:{tokens[k].line}"
        if word == "der" and "`derivative expression`" in text:
            end = texts.index(")", k) if ")" in texts[k:] else k
            if any(t.kind not in ("name", "number") and t.text not in ".[]," for t in tokens[k + 2 : end]):
                yield f"{source.name}:{tokens[k].line}"


def _mentions(text: str, model: str, source: Path, sources: Sources) -> Iterator[str]:
    """Where the names in a message are written: in the user's file, else in files that were read for it."""
    definition = sources.named(tuple(model.split(".")))
    files = [source, *sources.files()] if definition is not None else [source]
    for name in _QUOTED.findall(text):
        if name == model or name == model.rsplit(".", 1)[-1]:
            continue
        for file in files:
            for line in _lines_of(name, file):
                yield f"{file.name}:{line}"


def _lines_of(name: str, file: Path) -> Iterable[int]:
    parts = re.findall(r"[^.]+|\.", name)
    tokens = _tokens(file)
    width = len(parts)
    return [
        tokens[k].line
        for k in range(len(tokens) - width)
        if [t.text for t in tokens[k : k + width]] == parts
        and tokens[k - 1].text != "."
        and tokens[k + width].text != "."
    ]


def _tokens(file: Path) -> list[Token]:
    try:
        return tokens_of(modelica_text(file), file.name)
    except ModelicaError:
        return []
