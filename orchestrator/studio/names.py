"""Names that come from a browser, made fit for a file."""

import re
import unicodedata

# Bytes; most file systems take 255, and temporary names need some room.
LONGEST = 200
_FORBIDDEN = frozenset(':*?"<>|%')
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


def model_words(model: str) -> str:
    """A project's model as people call it: a built-in one by its name, a class with its file.

    >>> model_words("arm"), model_words("model/Drive.fmu"), model_words("model/Rig.mo:Rig.Plant")
    ('arm', 'Drive.fmu', 'Rig.Plant (Rig.mo)')
    """
    file, _, name = model.removeprefix("model/").rpartition(":")
    return f"{name} ({file})" if file else name


def safe_name(text: str) -> str:
    """The last part of a path, without anything that a file system or a shell could take amiss; never empty.

    Example:
        >>> safe_name("../../etc/passwd"), safe_name("C:\\\\a\\\\trial 1.csv"), safe_name("..")
        ('passwd', 'trial 1.csv', 'file')
    """
    last = re.split(r"[/\\]", unicodedata.normalize("NFC", text))[-1]
    kept = "".join("_" if c in _FORBIDDEN or not c.isprintable() else c for c in last)
    kept = kept.encode()[-LONGEST:].decode(errors="ignore").strip(" .-~")
    return f"_{kept}" if _RESERVED.fullmatch(kept) else kept or "file"
