"""FMUs of Modelica classes, made when a system names them."""

import hashlib
from pathlib import Path


def built_fmu(model: str, folder: Path = Path()) -> Path:
    """FMU of a built-in model or of `FILE.mo:Package.Class`, in a folder of the cache that belongs to its name and file.

    Args:
        model: as on the command line; a file is relative to `folder`.

    Raises:
        MisfitError: if there is no such model, or it cannot be built.
    """
    from fmus.build import Target, build_all
    from fmus.catalogue import find_modelica_model
    from fmus.files import cache_folder

    found = find_modelica_model(str(folder / model) if ".mo:" in model else model)
    place = hashlib.sha256(f"{found.name}\0{found.file and found.file.resolve()}".encode()).hexdigest()[:16]
    path = cache_folder("models") / place / f"{found.name.rsplit('.', 1)[-1]}.fmu"
    build_all([Target(found, "2.0", path)], workers=1)
    return path.resolve()
