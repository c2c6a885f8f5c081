"""Files with one value in a row, beside the name of its signal, as databases of time series and decoders of buses write them."""

from collections.abc import Sequence
from dataclasses import replace

from orchestrator.measurements.dirty.cells import kind_of
from orchestrator.measurements.dirty.header_units import read_unit
from orchestrator.measurements.dirty.reading import Reading

# A mode or a remark stands once in each row of a usual table; here rows of one time follow each other, one for each signal.
LEAST_REPEATED = 0.2
MOST_SIGNALS = 500
Cells = Sequence[Sequence[str]]


def long_form(names: Sequence[str], cells: Cells, reading: Reading) -> tuple[Reading, dict[str, str]]:
    """How a file is read that has one number in a row beside its time, and a word that says of which signal; units by signal.

    Args:
        names: of the columns.
        cells: the rows.
        reading: how it is read so far, with its time; it comes back as it is for any other file.
    """
    rows = cells[: 20 * MOST_SIGNALS]
    kinds = [[kind_of(row[place], reading.decimal) for row in rows] for place in range(len(names))]
    numbers = [p for p, own in enumerate(kinds) if own.count("number") > len(rows) / 2 and names[p] not in reading.time]
    words = [p for p, own in enumerate(kinds) if own.count("text") > 0.9 * len(rows)]
    at = [tuple(row[p] for p, name in enumerate(names) if name in reading.time) for row in rows]
    if len(numbers) != 1 or not words or not reading.time:
        return reading, {}
    for place in words:
        signals = {row[place] for row in rows}
        repeated = sum(a == b and x[place] != y[place] for a, b, x, y in zip(at, at[1:], rows, rows[1:], strict=False))
        if 1 < len(signals) <= MOST_SIGNALS and repeated > LEAST_REPEATED * len(rows):
            units = {row[place]: unit for row in rows for p in words if p != place and (unit := read_unit(row[p]))}
            return replace(reading, signal=names[place], value=names[numbers[0]]), units
    return reading, {}


def widened(
    names: Sequence[str], cells: Cells, lines: Sequence[int], reading: Reading
) -> tuple[tuple[str, ...], list[list[str]], list[int]]:
    """Names, rows and lines of a table with a row for each time and a column for each signal; a signal without a value has an
    empty cell.

    >>> reading = Reading(time=("t",), signal="of", value="is")
    >>> widened(("t", "of", "is"), [["0", "u", "1"], ["0", "q", "2"], ["1", "q", "3"]], [2, 3, 4], reading)
    (('t', 'u', 'q'), [['0', '1', '2'], ['1', '', '3']], [2, 4])
    """
    time = [names.index(name) for name in reading.time]
    signal, value = names.index(reading.signal), names.index(reading.value)
    places = {name: k for k, name in enumerate(dict.fromkeys(row[signal] for row in cells), start=len(time))}
    found: dict[tuple[str, ...], list[str]] = {}
    first: list[int] = []
    for row, line in zip(cells, lines, strict=True):
        at = tuple(row[k] for k in time)
        if at not in found:
            found[at] = [*at, *[""] * len(places)]
            first.append(line)
        found[at][places[row[signal]]] = row[value]
    return (*reading.time, *places), list(found.values()), first
