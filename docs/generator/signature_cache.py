"""Signatures and their pictures, drawn once for each content of the models and of this code."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from docs.generator.pictures import picture
from docs.generator.scenes import Group, groups, scenes
from docs.generator.signatures import Signature, signatures
from fmus.files import cache_folder, write_atomically
from fmus.library import library_root

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
# Whatever can change a curve or its picture.
SOURCES = (
    *(
        HERE / name
        for name in ("plants.py", "scenes.py", "scenes.toml", "signatures.py", "pictures.py", Path(__file__).name)
    ),
    ROOT / "orchestrator" / "models",
    ROOT / "orchestrator" / "library" / "cards",
    ROOT / "orchestrator" / "report" / "palette.py",
    ROOT / "fmus" / "symbolic",
    ROOT / "fmus" / "flat",
)


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect as its class declares it; `shown` is its value in the picture."""

    name: str
    unit: str
    description: str
    minimum: float | None
    maximum: float | None


@dataclass(frozen=True)
class Shown:
    """What a page of the catalogue needs of a signature."""

    png: Path
    alt: str
    parameters: tuple[Parameter, ...]
    values: Mapping[str, float]


def shown_effects() -> dict[str, Shown]:
    """Every effect card by name, with its picture."""
    key = _content()
    found: dict[str, Shown] = {}
    for group in groups(scenes()):
        found |= _kept(group, key)
    return {scene.name: found[scene.name] for scene in scenes()}


def _kept(group: Group, key: str) -> dict[str, Shown]:
    folder = cache_folder("signatures") / key
    names = [scene.name for scene in group.slots.values()]
    if not all((folder / f"{name}.json").is_file() for name in names):
        for signature in signatures(group):
            _keep(folder, signature)
    return {name: _read(folder, name) for name in names}


def _keep(folder: Path, signature: Signature) -> None:
    drawn = picture(signature)
    name = signature.scene.name
    write_atomically(folder / f"{name}.png", drawn.png)
    elements = {v.name.rpartition(".")[2].split("[")[0]: v for v in reversed(signature.parameters)}
    about = {
        "alt": drawn.alt,
        "values": signature.shown,
        "parameters": [
            asdict(Parameter(own, v.unit, v.description, v.minimum, v.maximum)) for own, v in elements.items()
        ],
    }
    write_atomically(folder / f"{name}.json", json.dumps(about).encode())


def _read(folder: Path, name: str) -> Shown:
    about = json.loads((folder / f"{name}.json").read_text())
    parameters = tuple(Parameter(**each) for each in about["parameters"])
    return Shown(folder / f"{name}.png", about["alt"], parameters, about["values"])


def _content() -> str:
    """Hash of everything that a picture depends on."""
    files = [file for source in (*SOURCES, library_root()) for file in _files(source)]
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _files(source: Path) -> list[Path]:
    if source.is_file():
        return [source]
    return sorted(f for f in source.rglob("*") if f.suffix in (".py", ".toml", ".mo", ".c"))
