"""The files of a system structure: an unpacked SSP, or a folder with an SSD; nothing outside is read."""

import hashlib
import shutil
import tempfile
from pathlib import Path
from urllib.parse import unquote, urlsplit

from fmus.archive import extract_fmu
from fmus.errors import MisfitError
from fmus.files import cache_folder
from orchestrator.measurements.wording import shown

STRUCTURE = "SystemStructure.ssd"


def unpacked(path: Path) -> Path:
    """Folder with the content of an SSP, kept in the cache under the hash of the file.

    Raises:
        FmuError: if the file is no SSP or not safe to unpack, see `fmus.archive`.
    """
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected an SSP") from error
    folder = cache_folder("ssp") / digest
    if not folder.is_dir():
        temporary = Path(tempfile.mkdtemp(dir=folder.parent))
        try:
            extract_fmu(path, temporary, STRUCTURE)
            temporary.rename(folder)
        except OSError:
            if not folder.is_dir():  # else another process was quicker
                raise
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    return folder


def located(uri: str, beside: Path, root: Path, where: str) -> tuple[Path, str]:
    """File and fragment that a relative URI names, seen from the file `beside`; backslashes of Windows are slashes.

    Raises:
        MisfitError: if the URI has a scheme, leads out of `root`, or names no file.
    """
    parts = urlsplit(uri)
    if parts.scheme or parts.netloc or parts.query:
        raise MisfitError(
            f"{where}: source {shown(uri)} is no relative path; copy the file beside the system structure"
        )
    if not parts.path:
        return beside, unquote(parts.fragment)
    file = (beside.parent / unquote(parts.path).replace("\\", "/")).resolve()
    if not file.is_relative_to(root.resolve()):
        raise MisfitError(f"{where}: source {shown(uri)} is outside the folder of the system structure")
    if not file.is_file():
        raise MisfitError(f"{where}: source {shown(uri)} does not exist")
    return file, unquote(parts.fragment)
