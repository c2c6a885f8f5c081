"""The built-in models, and how a model is named on the command line."""

import hashlib
import re
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.files import cache_folder, write_atomically
from fmus.frontend.compile import compile_class, fingerprint
from fmus.library import library_root
from fmus.symbolic.balances import Balance, with_balances
from fmus.symbolic.build import build_system
from fmus.symbolic.store import from_bytes, to_bytes
from fmus.symbolic.system import SymbolicSystem


@dataclass(frozen=True)
class ModelicaModel:
    """A Modelica class that can be built: its name, its file (None: the library) and its experiment.

    `held` are inputs that stay at a sample's value until the next sample in the record that it is held against.
    """

    name: str
    class_name: str
    file: Path | None = None
    stop_time_s: float = 10.0
    step_size_s: float = 0.004
    held: tuple[str, ...] = ()

    def compile(self) -> SymbolicSystem:
        """Return the symbolic form of the class; it is kept in the cache by the content of all sources.

        Raises:
            ModelicaError: if it cannot be compiled or uses an unsupported construct.
        """
        kept = self._kept
        if kept.is_file():
            return from_bytes(kept.read_bytes())
        system = build_system(compile_class(self.class_name, self.file), self.class_name, self.description)
        write_atomically(kept, to_bytes(system))
        return system

    def balanced(self) -> tuple[SymbolicSystem, tuple[Balance, ...]]:
        """Return the symbolic form with an input at each balance equation, and these equations.

        Raises:
            ModelicaError: if it cannot be compiled or uses an unsupported construct.
        """
        return with_balances(compile_class(self.class_name, self.file), self.class_name, self.description)

    @property
    def is_compiled(self) -> bool:
        """Whether the cache holds the symbolic form."""
        return self._kept.is_file()

    @property
    def fingerprint(self) -> str:
        """Content hash of the class, of all that it uses and of the translator."""
        return f"{fingerprint(self.class_name, self.file)}-{_translator()}"

    @property
    def _kept(self) -> Path:
        return cache_folder("systems") / f"{self.fingerprint}.json"

    @property
    def description(self) -> str:
        """The string comment of the class, empty if it has none."""
        short = self.class_name.rsplit(".", 1)[-1]
        source = self.file or library_root() / Path(*self.class_name.split(".")).with_suffix(".mo")
        found = re.search(rf"\bmodel\s+{re.escape(short)}\s*\"([^\"]*)\"", source.read_text())
        return found.group(1) if found else ""


@cache
def _translator() -> str:
    """Content hash of the translator's own code: another translator may give another system."""
    sources = [path for part in ("symbolic", "flat") for path in sorted((Path(__file__).parent / part).glob("*.py"))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


@cache
def built_in_models() -> dict[str, ModelicaModel]:
    """Return the built-in models by name."""
    entries = tomllib.loads((Path(__file__).parent / "catalogue.toml").read_text())
    return {
        name: ModelicaModel(name, entry["class"], None, entry["stop_time_s"], entry["step_size_s"])
        for name, entry in entries.items()
    }


def find_modelica_model(text: str) -> ModelicaModel:
    """Return the model that `NAME` or `FILE.mo:Package.Class` stands for.

    Raises:
        ModelicaError: if there is no such built-in or file.
    """
    file_name, colon, class_name = text.rpartition(":")
    if colon and file_name.endswith(".mo"):
        file = Path(file_name)
        if not file.is_file():
            raise ModelicaError(f"Modelica file {file} does not exist")
        return ModelicaModel(class_name, class_name, file)
    if text.endswith(".mo"):
        raise ModelicaError(f"'{text}' names no class; write {text}:Package.Class")
    models = built_in_models()
    if text not in models:
        raise ModelicaError(f"there is no model '{text}'; built-in models are {', '.join(models)}; or name a file")
    return models[text]
