"""Reading FMU archives without trusting them."""

import shutil
import stat
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath
from xml.parsers import expat

from fmus.errors import FmuError

MAX_TOTAL_BYTES = 2**30
MAX_ENTRIES = 20_000
# What file systems take; the folder that an archive is unpacked to needs some of it.
MAX_NAME_BYTES, MAX_PATH_BYTES = 255, 3000
# Deflate cannot do much better than 1000; text and binaries of FMUs stay below 30.
MAX_RATIO = 300
RATIO_MATTERS_ABOVE_BYTES = 2**24


FMU_DESCRIPTION = "modelDescription.xml"


def read_archive(path: Path, description: str | None = FMU_DESCRIPTION) -> dict[str, bytes]:
    """Give all files of an archive, archive path -> content, after the checks of `extract_fmu`.

    None as `description` takes any zip archive.
    """
    with _opened(path, description) as (archive, entries):
        return {entry.filename: _read(path, archive, entry) for entry in entries if not entry.is_dir()}


def extract_fmu(path: Path, folder: Path, description: str = FMU_DESCRIPTION) -> Path:
    """Unpack an FMU below `folder`, which is created where missing, and give the folder back.

    An SSP is unpacked likewise, with its SystemStructure.ssd as `description`.

    Raises:
        FmuError: if the file is no FMU (not a zip, no modelDescription.xml) or is not safe to unpack:
            paths that leave the folder or are too long, links, encrypted entries, different ones of one name, more than 1 GiB unpacked
            or compressed beyond reason, or a model description with a DOCTYPE.
    """
    with _opened(path, description) as (archive, entries):
        for entry in entries:
            target = folder / entry.filename
            if entry.is_dir():
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            # Writing into a library that is loaded would crash whoever uses it.
            target.unlink(missing_ok=True)
            target.write_bytes(_read(path, archive, entry))
    return folder


def extracted_once(path: Path, folder: Path, description: str = FMU_DESCRIPTION) -> Path:
    """Unpack a file into a folder that appears as a whole, unless it is there, and give the folder back.

    Raises:
        FmuError: as `extract_fmu`.
        OSError: if the folder cannot be written.
    """
    if folder.is_dir():
        return folder
    temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".new-"))
    try:
        extract_fmu(path, temporary, description)
        try:
            temporary.rename(folder)
        except OSError:  # somebody else was faster
            if not folder.is_dir():
                raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def check_archive(path: Path, description: str | None = FMU_DESCRIPTION) -> None:
    """Raise FmuError unless `extract_fmu` would begin to unpack a file; None as `description` takes any zip archive."""
    with _opened(path, description):
        pass


def check_entry_name(name: str) -> None:
    """Raise FmuError unless `name` is a relative path with forward slashes that stays inside."""
    outside = name.startswith("/") or PureWindowsPath(name).drive or ".." in PurePosixPath(name).parts
    if not name or outside or "\\" in name or "\0" in name:
        raise FmuError(f"archive entry {name!r} is not a relative path inside the archive")


def check_xml(content: bytes, what: str) -> None:
    """Raise FmuError unless `content` is well-formed XML without a document type.

    A DOCTYPE can define entities that read other files or grow without limit; FMI needs none.
    """

    def refuse(*_: object) -> None:
        raise FmuError(f"{what} has a DOCTYPE, which FMI does not use; remove it")

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FmuError(f"{what} is not well-formed XML: {error}") from error


@contextmanager
def _opened(path: Path, description: str | None) -> Iterator[tuple[zipfile.ZipFile, list[zipfile.ZipInfo]]]:
    kind = {FMU_DESCRIPTION: "an FMU", None: "an archive"}.get(description, "an SSP")
    if not path.is_file():
        raise FmuError(f"{path} does not exist" if not path.exists() else f"{path} is not a file")
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise FmuError(f"{path} is not {kind}: it cannot be read as a zip archive ({error})") from error
    with archive:
        entries = archive.infolist()
        _check_entries(path, entries)
        if description is not None:
            _check_description(path, archive, description, kind)
        yield archive, entries


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MAX_ENTRIES:
        raise FmuError(f"{path} has {len(entries)} entries; the limit is {MAX_ENTRIES}")
    seen: dict[str, zipfile.ZipInfo] = {}
    for entry in entries[:]:
        # Some tools of Windows write backslashes, which zipfile turns into slashes there and leaves as they are elsewhere.
        names = [name.replace("\\", "/") for name in (entry.filename, entry.orig_filename)]
        entry.filename = names[0]
        # zipfile cuts names at a NUL.
        for name in names:
            try:
                check_entry_name(name)
            except FmuError as error:
                raise FmuError(f"{path}: {error}") from error
        _check_length(path, entry.filename)
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise FmuError(f"{path}: entry {entry.filename!r} is a symbolic link")
        if entry.flag_bits & 0x1:
            raise FmuError(f"{path}: entry {entry.filename!r} is encrypted")
        first = seen.setdefault(entry.filename, entry)
        if first is not entry:
            if (first.CRC, first.file_size) != (entry.CRC, entry.file_size):
                raise FmuError(f"{path}: entry {entry.filename!r} occurs twice, with different contents")
            entries.remove(entry)
    _check_size(path, entries)


def _check_length(path: Path, name: str) -> None:
    longest = max((len(part.encode()) for part in PurePosixPath(name).parts), default=0)
    if longest > MAX_NAME_BYTES or len(name.encode()) > MAX_PATH_BYTES:
        limits = f"{MAX_NAME_BYTES} bytes a name and {MAX_PATH_BYTES} a path"
        raise FmuError(
            f"{path}: entry '{name[:40]}...' has a name of {len(name.encode())} bytes; the limits are {limits}"
        )


def _check_size(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    total = sum(entry.file_size for entry in entries)
    packed = max(1, path.stat().st_size)
    if total > MAX_TOTAL_BYTES:
        raise FmuError(f"{path} unpacks to {total / 2**20:.0f} MiB; the limit is {MAX_TOTAL_BYTES // 2**20} MiB")
    if total > RATIO_MATTERS_ABOVE_BYTES and total > MAX_RATIO * packed:
        raise FmuError(f"{path} unpacks to {total / packed:.0f} times its size; the limit is {MAX_RATIO} times")


def _check_description(path: Path, archive: zipfile.ZipFile, name: str, kind: str) -> None:
    try:
        entry = archive.getinfo(name)
    except KeyError:
        raise FmuError(f"{path} is not {kind}: it has no {name} at the top of the archive") from None
    check_xml(_read(path, archive, entry), f"{path}: {name}")


def _read(path: Path, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    try:
        return archive.read(entry)
    except Exception as error:  # broken data surfaces as zlib, lzma, struct, EOF and other errors
        raise FmuError(f"{path}: entry {entry.filename!r} is damaged ({error})") from error
