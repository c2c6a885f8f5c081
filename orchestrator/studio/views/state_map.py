"""The residual over two coordinates of the state, in boxes of equal size."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.coordinates import Coordinates
from orchestrator.studio.views.selection import Range, Selection

ACROSS, ALONG = 24, 16
# A box with fewer samples than this is drawn, but nothing is said of it.
ENOUGH = 10


@dataclass(frozen=True, eq=False)
class Boxes:
    """Number of samples, mean and root mean square of a residual in each box, (rows, columns); NaN where none is."""

    count: np.ndarray
    mean: np.ndarray
    rms: np.ndarray


@dataclass(frozen=True, eq=False)
class StateMap:
    """A residual over `across` (columns, bounds `across_edges`) and `along` (rows, bounds `along_edges`).

    `whole` is over all samples of the trials shown, `selected` over those within the selected time.
    """

    signal: str
    across: str
    along: str
    across_edges: np.ndarray
    along_edges: np.ndarray
    whole: Boxes
    selected: Boxes

    def place(self, row: int, column: int, units: Sequence[str]) -> str:
        """A box in words; `units` are those of `across` and `along`."""
        edges = ((self.across, self.across_edges, column), (self.along, self.along_edges, row))
        said = [
            f"{name} is {digits(float(at[k]))} to {digits(float(at[k + 1]))} {unit}".rstrip()
            for (name, at, k), unit in zip(edges, units, strict=True)
        ]
        return " and ".join(said)


def state_map(coordinates: Coordinates, signal: str, across: str, along: str, selection: Selection) -> StateMap | None:
    """Map the residual of a signal; of the selection its trials and its time count, a region is what a map is for.

    Returns:
        None if a coordinate does not vary or no sample is finite.
    """
    data, stride = coordinates.data, coordinates.stride
    places = data.shown(selection.trials)
    series = [
        tuple(
            values[k]
            for values in (coordinates.values(across), coordinates.values(along), coordinates.residual(signal))
        )
        for k in places
    ]
    edges = [_edges([part[axis] for part in series], number) for axis, number in ((0, ACROSS), (1, ALONG))]
    if edges[0] is None or edges[1] is None:
        return None
    windows = [data.trials[k].samples(selection.time) for k in places]
    rows = [slice(-(-start // stride), -(-stop // stride)) for start, stop in windows]
    whole = _boxes(series, edges[0], edges[1])
    within = [tuple(values[part] for values in each) for each, part in zip(series, rows, strict=True)]
    selected = whole if selection.time is None else _boxes(within, edges[0], edges[1])
    return StateMap(signal, across, along, edges[0], edges[1], whole, selected)


def map_sentence(found: StateMap, units: Sequence[str], unit: str, floor: float) -> str:
    """Where the error is largest and where smallest."""
    boxes, said = found.selected, ", where selected" if found.selected is not found.whole else ""
    enough = boxes.count >= min(ENOUGH, int(boxes.count.max(initial=0)))
    if not boxes.count.any():
        return f"Residual of {found.signal}: no sample is within the selected time."
    rms = np.where(enough & (boxes.count > 0), boxes.rms, np.nan)
    worst, best = (np.unravel_index(find(rms), rms.shape) for find in (np.nanargmax, np.nanargmin))
    times = f", {digits(rms[worst] / floor)} times the noise floor," if floor else ""
    return (
        f"Residual of {found.signal} over {found.across} and {found.along}{said}: largest, {quantity(rms[worst], unit)} rms"
        f"{times} where {found.place(int(worst[0]), int(worst[1]), units)};"
        f" smallest, {quantity(rms[best], unit)}, where {found.place(int(best[0]), int(best[1]), units)}."
    )


def map_rows(found: StateMap, units: Sequence[str], unit: str, most: int = 20) -> list[list[str]]:
    """The boxes with the largest errors as rows of a table."""
    boxes = found.selected
    order = np.argsort(np.where(boxes.count > 0, -boxes.rms, np.inf), axis=None)[
        : min(most, int((boxes.count > 0).sum()))
    ]
    rows = []
    for row, column in zip(*np.unravel_index(order, boxes.rms.shape), strict=True):
        numbers = [quantity(float(values[row, column]), unit) for values in (boxes.rms, boxes.mean)]
        rows.append([found.place(int(row), int(column), units), *numbers, str(int(boxes.count[row, column]))])
    return rows


def _edges(parts: Sequence[np.ndarray], number: int) -> np.ndarray | None:
    finite = [part[np.isfinite(part)] for part in parts]
    ends = [(part.min(), part.max()) for part in finite if part.size]
    if not ends:
        return None
    found = Range(float(min(low for low, _ in ends)), float(max(high for _, high in ends)))
    return np.linspace(found.low, found.high, number + 1) if found.low < found.high else None


def _boxes(series: Sequence[tuple[np.ndarray, ...]], across: np.ndarray, along: np.ndarray) -> Boxes:
    shape = (len(along) - 1, len(across) - 1)
    sums = np.zeros((3, shape[0] * shape[1]))
    for x, y, residual in series:
        good = np.isfinite(x) & np.isfinite(y) & np.isfinite(residual)
        flat = _bin(y[good], along) * shape[1] + _bin(x[good], across)
        error = residual[good].astype(float)
        for total, weights in zip(sums, (None, error, error * error), strict=True):
            total += np.bincount(flat, weights, minlength=len(total))
    count, total, square = (part.reshape(shape) for part in sums)
    with np.errstate(invalid="ignore"):
        return Boxes(count.astype(int), total / count, np.sqrt(square / count))


def _bin(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Bin of each value among edges at equal distances; the last edge belongs to the last bin."""
    share = (values.astype(float) - edges[0]) / (edges[-1] - edges[0])
    return np.clip((share * (len(edges) - 1)).astype(int), 0, len(edges) - 2)


STATISTICS: dict[str, Callable[[Boxes], np.ndarray]] = {
    "size (rms)": lambda boxes: boxes.rms,
    "mean, with sign": lambda boxes: boxes.mean,
}
