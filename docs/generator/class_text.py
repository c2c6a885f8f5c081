"""What a Modelica class of the library says about itself: its documentation, its equations, its slots."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fmus.library import library_root


@dataclass(frozen=True)
class ClassText:
    """`law` and `remarks` are the paragraphs of its documentation as HTML, `equations` its equation section as text.

    `equations_of` names the class that states them: a class that only chooses values takes them from its parent.
    """

    law: str
    remarks: tuple[str, ...]
    equations: str
    equations_of: str
    description: str


@cache
def read_class(name: str) -> ClassText:
    """Read a class of `FESArm` by its full name.

    Raises:
        ValueError: if it has no documentation, or neither it nor a class that it extends states equations.
    """
    text = source_of(name)
    first, *others = _paragraphs(name, text)
    home, equations = _equations(name, text)
    if home != name:  # the parent states the law, the class itself says what it chooses
        law, *more = _paragraphs(home, source_of(home))
        others = [first, *others, *more]
        first = law
    comment = re.search(r"^(?:partial )?(?:model|block) \w+ \"([^\"]*)\"", text, re.MULTILINE)
    return ClassText(first, tuple(others), equations, home, comment.group(1) if comment else "")


@cache
def source_of(name: str) -> str:
    """The Modelica text of a class that has a file of its own."""
    return (library_root() / Path(*name.split("."))).with_suffix(".mo").read_text()


@cache
def slots_of(name: str) -> frozenset[str]:
    """Replaceable parts of a class and of those that it extends, such as `jointTorque1`."""
    text = source_of(name)
    own = frozenset(f"{slot[0].lower()}{slot[1:]}" for slot in re.findall(r"replaceable model (\w+\d)\b", text))
    parents = (_full_name(parent, name) for parent in re.findall(r"^\s*extends ([\w.]+)", text, re.MULTILINE))
    return own.union(*(slots_of(parent) for parent in parents))


def _paragraphs(name: str, text: str) -> list[str]:
    found = re.search(r"Documentation\(info=\"(.*?)\"\)", text, re.DOTALL)
    paragraphs = re.findall(r"<p>(.*?)</p>", found.group(1), re.DOTALL) if found else []
    if not paragraphs:
        raise ValueError(f"{name} has no documentation with a paragraph")
    return [" ".join(paragraph.split()) for paragraph in paragraphs]


def _equations(name: str, text: str) -> tuple[str, str]:
    """The class that states the equations, and their text without the indentation of the section."""
    found = re.search(r"^equation\n(.*?)(?=^\s*annotation\b|^end )", text, re.DOTALL | re.MULTILINE)
    if found:
        return name, "\n".join(line[2:] for line in found.group(1).rstrip().splitlines())
    parent = re.search(r"^\s*extends ([\w.]+)", text, re.MULTILINE)
    if parent is None:
        raise ValueError(f"{name} states no equations and extends no class that does")
    home = _full_name(parent.group(1), name)
    return _equations(home, source_of(home))


def _full_name(parent: str, name: str) -> str:
    """A class named in another one: by its full name, or beside it."""
    return parent if parent.startswith("FESArm.") else f"{name.rpartition('.')[0]}.{parent}"
