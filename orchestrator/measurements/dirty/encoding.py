"""Bytes of a text file as text, whatever program wrote them."""

import codecs
from pathlib import Path

from fmus.errors import MisfitError

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


def encoding_of(path: Path, content: bytes) -> str:
    """Find the encoding of a text file: by its byte order mark, by its zero bytes, else UTF-8 or Latin-1.

    Raises:
        MisfitError: the file is no text.

    Example:
        >>> encoding_of(Path("a.csv"), "θ;1".encode("utf-16")), encoding_of(Path("a.csv"), b"\\xb0C;1")
        ('utf-16', 'latin-1')
    """
    for mark, name in _MARKS:
        if content.startswith(mark):
            return name
    start = content[:4000]
    if start.count(0) > 0.3 * len(start):
        return "utf-16-be" if start[:1] == b"\0" else "utf-16-le"
    if 0 in content:
        raise MisfitError(
            f"{path}: a binary file (it contains zero bytes); expected a table as text, parquet, mf4 or h5"
        )
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def decoded(path: Path, content: bytes, encoding: str) -> list[str]:
    """Decode a file and cut it into lines, whatever ends them.

    Raises:
        MisfitError: the bytes are no text in this encoding, or Python knows no such encoding.
    """
    try:
        text = content.decode(encoding)
    except (UnicodeDecodeError, LookupError) as error:
        raise MisfitError(f"{path}: is no text in the encoding {encoding!r}; correct encoding in [reading]") from error
    return text.replace("\r\n", "\n").replace("\r", "\n").replace("\0", "").split("\n")
