"""Write a Modelica class that extends a model with effects, and compile it."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.lint.sources import without_within
from fmus.symbolic.system import SymbolicSystem


@dataclass(frozen=True)
class Attachment:
    """An effect class in a slot of a model, with values of its parameters.

    A parameter is a number, or the elements of an array by full name, such as `{"jointTorque1.b[1]": 0.1}`, in order.
    `class_text` is the Modelica text of the class if it is not one of the library.
    """

    slot: str
    class_name: str
    values: Mapping[str, float | Mapping[str, float]]
    class_text: str = ""


def free_slots(system: SymbolicSystem) -> tuple[str, ...]:
    """Return the slots of a model that hold an absent effect.

    A slot is a part with a structural parameter `present`, false in the absent effect.
    """
    suffix = ".present"
    return tuple(
        name.removesuffix(suffix) for name, value in system.settings.items() if name.endswith(suffix) and not value
    )


def patched_source(
    base: ModelicaModel,
    name: str,
    attachments: Sequence[Attachment],
    comment: str,
    adjusted: Mapping[str, float] = MappingProxyType({}),
) -> str:
    """Return Modelica text of a class `name` that extends `base` with effects.

    The text contains, in front, the base's own file and those of the effects if they are not classes of the library, so
    it stands alone.

    Args:
        adjusted: values of the base's own parameters by full name, such as `linkage.m[1]`; of an array all elements. They
            are marked as adjusted within their tolerances.
    """
    tree = _tree(adjusted)
    for part in attachments:
        tree.setdefault(part.slot, {}).update({key: _literal(value) for key, value in part.values.items()})
    redeclared = [f"redeclare model {p.slot[0].upper()}{p.slot[1:]} = {p.class_name}" for p in attachments]
    items = [*redeclared, *_written(tree)]
    extended = f"  extends {base.class_name}(\n    " + ",\n    ".join(items) + ");\n"
    own = f'model {name} "{_comment(comment)}"\n{extended}end {name};\n'
    parts = [] if base.file is None else [base.file.read_text()]
    parts += [
        without_within(text)
        for text in dict.fromkeys(part.class_text for part in attachments)
        if text not in ("", *parts)
    ]
    return "\n\n".join(text.strip() for text in (*parts, own)) + "\n"


def patched_model(
    base: ModelicaModel,
    name: str,
    attachments: Sequence[Attachment],
    *,
    adjusted: Mapping[str, float] = MappingProxyType({}),
    comment: str = "",
    folder: Path | None = None,
) -> ModelicaModel:
    """Write the extended class to `folder` (default: the cache) and return it as a model.

    Args:
        base: the model.
        name: name of the class that extends it.
        attachments: the effects, each with its slot and values.
        adjusted: values of parameters of the model itself, by full name.
        comment: what the class says of itself.
        folder: where `name.mo` is written; None: in the cache.

    Raises:
        ModelicaError: if the base's file belongs to a package, which cannot be copied on its own.
    """
    if base.file is not None and re.search(r"^\s*within\s+\w", base.file.read_text(), re.MULTILINE):
        raise ModelicaError(
            f"{base.file.name} is part of a package; put {base.class_name} into a file of its own to extend it"
        )
    text = patched_source(base, name, attachments, comment, adjusted)
    if folder is None:
        folder = cache_folder("patched") / hashlib.sha256(text.encode()).hexdigest()
    file = folder / f"{name}.mo"
    if not file.is_file() or file.read_text() != text:
        write_atomically(file, text.encode())
    return replace(base, name=name, class_name=name, file=file)


def check_attached(system: SymbolicSystem, attachments: Sequence[Attachment]) -> None:
    """Make sure that the compiled class really contains the effects; a front end may drop a redeclaration silently.

    Raises:
        ModelicaError: naming the slot and the class that is missing.
    """
    for part in attachments:
        if not system.settings.get(f"{part.slot}.present"):
            raise ModelicaError(f"{part.class_name} did not arrive in slot {part.slot} of {system.name}")


def check_adjusted(system: SymbolicSystem, adjusted: Mapping[str, float]) -> None:
    """Make sure that the compiled class has the adjusted values.

    Raises:
        ModelicaError: naming the first parameter that kept another value.
    """
    values = {v.name: v.start for v in system.parameters}
    for name, value in adjusted.items():
        if values.get(name) != value:
            raise ModelicaError(f"{name} = {value:g} did not arrive in {system.name}, which has {values.get(name)}")


def _tree(adjusted: Mapping[str, float]) -> dict[str, Any]:
    """`{"linkage.m[1]": 1.9, "linkage.m[2]": 1.5}` -> `{"linkage": {"m": '{1.9, 1.5} "adjusted within its tolerance"'}}`."""
    arrays: dict[str, dict[str, float]] = {}
    for full, value in adjusted.items():
        arrays.setdefault(re.sub(r"\[[\d,]+\]", "", full), {})[full] = value
    tree: dict[str, Any] = {}
    for path, elements in arrays.items():
        *parts, last = path.split(".")
        place = tree
        for part in parts:
            place = place.setdefault(part, {})
        place[last] = f'{_literal(elements)} "adjusted within its tolerance"'
    return tree


def _written(tree: Mapping[str, Any]) -> list[str]:
    """Modifiers of a class, nested ones in brackets."""
    return [f"{k}({', '.join(_written(v))})" if isinstance(v, dict) else f"{k}={v}" for k, v in tree.items()]


def _literal(value: float | Mapping[str, float]) -> str:
    """Modelica literal of a number, or of an array by its elements' full names, such as `m[1,2]` or `part[1].m[2]`."""
    if isinstance(value, int | float):
        return repr(float(value))
    numbers = [repr(float(item)) for item in value.values()]
    shape = [int(part) for part in re.findall(r"[\[,](\d+)", list(value)[-1])]
    if not shape:
        return numbers[0]
    for length in reversed(shape[1:]):
        numbers = ["{" + ", ".join(numbers[k : k + length]) + "}" for k in range(0, len(numbers), length)]
    return "{" + ", ".join(numbers) + "}"


def _comment(text: str) -> str:
    return text.replace("\\", "").replace('"', "'")
