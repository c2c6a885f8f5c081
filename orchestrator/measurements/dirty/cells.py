"""Text and cells of files by other tools: encodings, decimal commas, missing values, dates."""

import codecs
import csv
import math
import re
from pathlib import Path
from typing import Literal

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

    Args:
        path: the file, for messages.
        content: its bytes.
        encoding: name of the encoding.

    Raises:
        MisfitError: the bytes are no text in this encoding, or Python knows no such encoding.
    """
    try:
        text = content.decode(encoding)
    except (UnicodeDecodeError, LookupError) as error:
        raise MisfitError(f"{path}: is no text in the encoding {encoding!r}; correct encoding in [reading]") from error
    return _with_whole_cells(text.replace("\r\n", "\n").replace("\r", "\n").replace("\0", "").split("\n"))


def _with_whole_cells(lines: list[str]) -> list[str]:
    """Put cells in quotes that go over a few lines into the first of them; the others are left empty, so that numbers stay.

    >>> _with_whole_cells(['"time', '[s]",q', "0,1"])
    ['"time [s]",q', '', '0,1']
    """
    for start in range(min(HEAD, len(lines))):
        if lines[start].count('"') % 2 == 0:
            continue
        for end in range(start + 2, min(start + MOST_LINES, len(lines)) + 1):
            whole = " ".join(lines[start:end])
            if whole.count('"') % 2 == 0:
                lines[start:end] = [whole, *[""] * (end - start - 1)]
                break
    return lines


Kind = Literal["number", "stamp", "missing", "text"]

MISSING = frozenset(
    [
        "nan",
        "na",
        "n/a",
        "null",
        "none",
        "nil",
        "-",
        "--",
        "---",
        "?",
        "#n/a",
        "#na",
        "#value!",
        "#div/0!",
        "#num!",
        "inf",
        "-inf",
        "+inf",
        "infinity",
        "-infinity",
        "missing",
        "ol",
        "overflow",
        "underflow",
        "-nan",
        "1.#qnan",
        "-1.#ind",
        "1.#ind",
        "1.#inf",
        "-1.#inf",
        "bad",
        "error",
        "err",
        "invalid",
    ]
) | {""}
# Lines above the table that are looked at for cells over several lines, and how many lines such a cell may have.
HEAD, MOST_LINES = 50, 5
# A minus and blanks as word processors and spreadsheets write them.
_TYPESET = str.maketrans({"\u2212": "-", "\u00a0": " ", "\u202f": " ", "\u2009": " ", "\u2019": "'"})
_FORTRAN = re.compile(r"(\d\.?)[dD]([+-]?\d+)$")
_GROUPED = {
    ".": re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d+)?"),
    ",": re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?"),
}
_BLANKS = re.compile(r"[+-]?\d{1,3}(?:[ ']\d{3})+(?:[.,]\d+)?")
_CLOCK = r"\d{1,3}:\d{2}(?::\d{2}(?::\d{3})?)?(?:[.,]\d+)?(?:\s*[AaPp][Mm])?"
_COMPACT = re.compile(r"(?:19|20)\d{2}(?:0[1-9]|1[0-2])[0-3]\d[0-2]\d[0-5]\d[0-5]\d(?:[.,]\d+)?")
_DATE = r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{1,2}[-. /][A-Za-z]{3}[-. /]\d{2,4}|\d{8})"
_STAMP = re.compile(
    rf"(?:{_DATE}[T ]\s*(?:{_CLOCK}|\d{{6}}(?:[.,]\d+)?)|{_DATE}|{_CLOCK})\s*(?:Z|UTC|[+-]\d{{2}}:?\d{{2}})?"
)


def split_line(line: str, separator: str) -> list[str]:
    """Split a line into its cells, without the blanks around them; a separator " " stands for any run of blanks.

    >>> split_line('1.5; "a;b" ;', ";")
    ['1.5', 'a;b', '']
    """
    if separator == " ":
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    return [cell.strip() for cell in line.split(separator)]


def as_number(cell: str, decimal: str) -> float | None:
    """Read a finite number, with digits in groups or without; None for anything else.

    >>> as_number("1.234,5", ","), as_number("1,5", "."), as_number("2D-03", "."), as_number("\u22121\u202f234.5", ".")
    (1234.5, None, 0.002, -1234.5)
    """
    if not cell.isascii():
        cell = cell.translate(_TYPESET)
    if _BLANKS.fullmatch(cell):
        cell = cell.replace(" ", "").replace("'", "")
    other = "," if decimal == "." else "."
    if other in cell:
        if not _GROUPED[decimal].fullmatch(cell):
            return None
        cell = cell.replace(other, "")
    if decimal == ",":
        if cell.endswith(","):
            return None
        cell = cell.replace(",", ".")
    cell = _FORTRAN.sub(r"\1e\2", cell)
    # Python reads 1_000 as a number, files do not mean one by it.
    if "_" in cell:
        return None
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date, a time of the day, or both.

    >>> is_stamp("2024-03-01T12:00:00.5Z"), is_stamp("12:00:00,250"), is_stamp("1.5")
    (True, True, False)
    >>> is_stamp("20240301120000,250"), is_stamp("20249901120000")
    (True, False)
    """
    return bool(_COMPACT.fullmatch(cell)) or (":" in cell or not cell.isdigit()) and bool(_STAMP.fullmatch(cell))


def kind_of(cell: str, decimal: str) -> Kind:
    """What a cell is, read with a decimal sign."""
    if cell.lower() in MISSING:
        return "missing"
    if as_number(cell, decimal) is not None:
        return "stamp" if _COMPACT.fullmatch(cell) else "number"
    return "stamp" if is_stamp(cell) else "text"
