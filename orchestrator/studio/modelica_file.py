"""Which classes of a Modelica file can be a model."""

from pathlib import Path

from fmus.errors import MisfitError, ModelicaError
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.sources import modelica_text
from fmus.frontend.lint.tree import ClassDef

KINDS = ("model", "block")


def model_classes(file: Path, name: str) -> tuple[str, ...]:
    """Full names of the models of a file; those that no other one contains come first, the last declared before the others.

    Args:
        file: where it is now.
        name: what the user calls it, for messages.

    Raises:
        MisfitError: it is no Modelica, or declares no model.
    """
    try:
        top = parse(modelica_text(file), name)
    except (ModelicaError, UnicodeDecodeError) as error:
        raise MisfitError(f"{name} was not taken as a model: {error}") from error
    found = [pair for each in top for pair in _models(each, "")]
    if not found:
        raise MisfitError(f"{name} was not taken as a model: it declares no model or block that is not partial")
    used = {".".join(c.type_name).rsplit(".", 1)[-1] for _, each in found for c in each.components.values()}
    free = [full for full, _ in found if full.rsplit(".", 1)[-1] not in used]
    return (*reversed(free), *(full for full, _ in found if full not in free))


def _models(definition: ClassDef, prefix: str) -> list[tuple[str, ClassDef]]:
    full = f"{prefix}{definition.name}"
    own = [(full, definition)] if definition.kind in KINDS and "partial" not in definition.prefixes else []
    return own + [pair for each in definition.classes.values() for pair in _models(each, f"{full}.")]
