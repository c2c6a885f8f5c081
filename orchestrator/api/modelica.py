"""A Modelica model as one file that stands alone beside the library, with its class named as the file."""

import re
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.files import write_atomically


def write_modelica(source: ModelicaModel, target: Path) -> Path:
    """Write the class of a model to a file.

    A class of the library becomes a class that extends it. A class of a file is written with everything of its file; if
    the file belongs to a package it cannot stand alone.

    Raises:
        MisfitError: if the file's name is none of a class, or the class is part of a package.
    """
    name = target.stem
    if not re.fullmatch(r"[A-Za-z_]\w*", name):
        raise MisfitError(f"{target}: a Modelica class is named as its file; expected letters, digits and _")
    if source.file is None:
        text = f'model {name} "{source.description}"\n  extends {source.class_name};\nend {name};\n'
    else:
        text = _renamed(source.file, source.class_name, name)
    write_atomically(target, text.encode())
    return target


def _renamed(file: Path, class_name: str, name: str) -> str:
    """The text of a file with its class under another name."""
    text = file.read_text()
    if "." in class_name or re.search(r"^\s*within\s+\w", text, re.MULTILINE):
        raise MisfitError(f"{file.name} is part of a package; copy the package to keep {class_name}")
    return re.sub(rf"\b(model|end)\s+{re.escape(class_name)}\b", rf"\1 {name}", text)
