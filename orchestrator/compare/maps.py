"""Maps of an error over a coordinate, each beside the band that chance alone would give.

The band comes from block permutations: blocks of the residual, longer than its memory, are put into random order against
the coordinate, which breaks any dependence between the two and keeps the residual's own correlation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

BINS = 8
PERMUTATIONS = 99
BLOCK_S = 0.5
# Time around a change of direction that counts as a reversal, and over which amplitude and history are taken.
REVERSAL_S = 0.5
MEMORY_S = 2.0


@dataclass(frozen=True)
class ErrorMap:
    """Root mean square and bias of a residual in bins of equal population of a coordinate.

    `edges` (b + 1,); `rms`, `bias`, `low`, `high` and `count` (b,): the band holds 95 % of the rms that permuted blocks
    give. `p_value` tells how often permuted blocks show a dependence (in size or in bias) as strong as the data,
    `strength` is the share of the residual's square that its mean in each bin and the change of its size explain.
    """

    against: str
    unit: str
    edges: np.ndarray
    rms: np.ndarray
    bias: np.ndarray
    low: np.ndarray
    high: np.ndarray
    count: np.ndarray
    p_value: float
    strength: float

    @property
    def depends(self) -> bool:
        """Whether chance hardly ever gives such a map."""
        return self.p_value <= 0.05


@dataclass(frozen=True)
class Coordinate:
    """Something a residual may depend on, one array (n,) for each trial."""

    name: str
    unit: str
    values: tuple[np.ndarray, ...]


def error_map(
    residual: Sequence[np.ndarray], coordinate: Coordinate, step: float, *, seed: int = 0, bins: int = BINS
) -> ErrorMap | None:
    """Map a residual over a coordinate, with the band that chance alone would give.

    Args:
        residual: for each trial the error (n,), measured minus modelled.
        coordinate: for each trial the values (n,) that the error may depend on.
        step: sample interval, s.
        seed: of the permutations of blocks.
        bins: number of bins at most.

    Returns:
        None if the coordinate does not vary or there are too few samples for two bins and ten blocks.
    """
    return error_maps(residual, [coordinate], step, seed=seed, bins=bins)[0]


def error_maps(
    residual: Sequence[np.ndarray], coordinates: Sequence[Coordinate], step: float, *, seed: int = 0, bins: int = BINS
) -> list[ErrorMap | None]:
    """The same as `error_map` over several coordinates: what takes long, permuting the residual's blocks, is done once.

    Args:
        residual: for each trial the error (n,).
        coordinates: what the error may depend on.
        step: sample interval, s.
        seed: of the permutations.
        bins: number of bins at most.

    Returns:
        A map for each coordinate, None where `error_map` gives None.
    """
    error, length = np.concatenate(residual), max(1, round(BLOCK_S / step))
    found: list[ErrorMap | None] = [None] * len(coordinates)
    alike: dict[bytes, list[tuple[int, _Bins]]] = {}
    for k, coordinate in enumerate(coordinates):
        against = np.concatenate(coordinate.values)
        good = np.isfinite(error) & np.isfinite(against)
        placed = _Bins.of(coordinate, against[good], bins) if np.count_nonzero(good) >= 10 * length else None
        if placed is not None:
            alike.setdefault(good.tobytes(), []).append((k, placed))
    for mask, group in alike.items():
        known = error[np.frombuffer(mask, dtype=bool)]
        for (k, _), made in zip(group, _maps(known, [placed for _, placed in group], length, seed), strict=True):
            found[k] = made
    return found


@dataclass(frozen=True, eq=False)
class _Bins:
    """Bins of equal population of a coordinate: `edges` (b + 1,), `count` (b,), and means as a matrix, `share` (n, b)."""

    coordinate: Coordinate
    edges: np.ndarray
    count: np.ndarray
    share: np.ndarray

    @staticmethod
    def of(coordinate: Coordinate, against: np.ndarray, bins: int) -> "_Bins | None":
        """None if there are not two bins."""
        edges = np.unique(np.quantile(against, np.linspace(0, 1, bins + 1))) if against.size else np.zeros(0)
        if len(edges) < 3:
            return None
        place = np.clip(np.searchsorted(edges, against, side="right") - 1, 0, len(edges) - 2)
        belongs = (place[:, None] == np.arange(len(edges) - 1)).astype(float)
        count = belongs.sum(axis=0)
        return _Bins(coordinate, edges, count, belongs / np.maximum(count, 1))


def _maps(error: np.ndarray, binned: Sequence[_Bins], length: int, seed: int) -> list[ErrorMap]:
    """Maps of an error (n,) over several coordinates of the same samples."""
    shares, ends = np.hstack([each.share for each in binned]), np.cumsum([len(each.count) for each in binned])[:-1]
    shuffled = error[_shuffles(error.size, length, seed)]
    parts = [np.split(table @ shares, ends, axis=-1) for table in (error, error**2, shuffled, shuffled**2)]
    total = float(np.mean(error**2)) or 1.0
    return [_map(each, a, b, c, d, total) for each, a, b, c, d in zip(binned, *parts, strict=True)]


def _map(
    binned: _Bins, bias: np.ndarray, square: np.ndarray, other_bias: np.ndarray, other_square: np.ndarray, total: float
) -> ErrorMap:
    """A map from the means and mean squares (b,) in the bins, and those of the permuted blocks (p, b)."""
    shares = binned.count / binned.count.sum()

    def spreads(bias: np.ndarray, square: np.ndarray) -> np.ndarray:
        """How much bias and size vary over the bins, as shares of the square; (..., b) gives (..., 2)."""
        return np.stack([bias**2 @ shares / total, (square / total - 1.0) ** 2 @ shares], axis=-1)

    chance, mine = spreads(other_bias, other_square), spreads(bias, square)
    low, high = np.quantile(np.sqrt(other_square), (0.025, 0.975), axis=0)
    p_values = [(1 + np.sum(chance[:, k] >= mine[k])) / (1 + PERMUTATIONS) for k in (0, 1)]
    excess = mine - chance.mean(axis=0)
    return ErrorMap(
        binned.coordinate.name,
        binned.coordinate.unit,
        binned.edges,
        np.sqrt(square),
        bias,
        low,
        high,
        binned.count.astype(int),
        float(min(1.0, 2 * min(p_values))),  # two looks at one map
        float(max(excess[0], min(excess[1], 1.0), 0.0)),
    )


def coordinates_of(
    signals: Mapping[str, Sequence[np.ndarray]],
    units: Mapping[str, str],
    inputs: Mapping[str, Sequence[np.ndarray]],
    input_units: Mapping[str, str],
    times: Sequence[np.ndarray],
) -> list[Coordinate]:
    """What an error may depend on: positions, speeds, reversals, amplitudes, inputs, their history, and time.

    Args:
        signals: measured outputs by name, for each trial an array (n,).
        units: of the signals.
        inputs: measured inputs by name, likewise.
        input_units: of the inputs.
        times: of each trial (n,), s.
    """
    found = []
    for name, series in signals.items():
        speeds = [np.gradient(_smooth(x, t, 0.05), t) for x, t in zip(series, times, strict=True)]
        rate = f"{units.get(name) or '1'}/s"
        found.append(Coordinate(name, units.get(name, ""), tuple(series)))
        found.append(Coordinate(f"speed of {name}", rate, tuple(speeds)))
        near = [_from_reversal(w, t) for w, t in zip(speeds, times, strict=True)]
        found.append(Coordinate(f"time from a reversal of {name}", "s", tuple(near)))
        sizes = [np.sqrt(_past((x - _past(x, t)) ** 2, t)) for x, t in zip(series, times, strict=True)]
        found.append(Coordinate(f"amplitude of {name}", units.get(name, ""), tuple(sizes)))
    for name, series in inputs.items():
        unit = input_units.get(name, "")
        found.append(Coordinate(name, unit, tuple(series)))
        past = [_past(x, t) for x, t in zip(series, times, strict=True)]
        found.append(Coordinate(f"history of {name}", unit, tuple(past)))
    return [*found, Coordinate("time", "s", tuple(times))]


@lru_cache(maxsize=8)
def _shuffles(samples: int, length: int, seed: int) -> np.ndarray:
    """Orders (PERMUTATIONS, samples) of blocks: at random, from a random beginning, each forwards or backwards."""
    random = np.random.default_rng(seed)
    found = np.empty((PERMUTATIONS, samples), dtype=np.int32)
    for row in found:
        turned = np.roll(np.arange(samples), int(random.integers(samples)))
        blocks = np.array_split(turned, max(2, samples // length))
        order = random.permutation(len(blocks))
        row[:] = np.concatenate([blocks[k][:: 1 if random.random() < 0.5 else -1] for k in order])
    return found


def _from_reversal(speed: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Time to the nearest change of direction, at most `REVERSAL_S`."""
    moving = np.abs(speed) > 0.02 * np.abs(speed).max(initial=0.0)
    places = np.flatnonzero(moving)
    signs = np.sign(speed[places])
    turns = places[1:][signs[1:] != signs[:-1]]
    if turns.size == 0:
        return np.full(len(time), REVERSAL_S)
    at = time[turns]
    right = np.clip(np.searchsorted(at, time), 0, len(at) - 1)
    left = np.clip(right - 1, 0, len(at) - 1)
    return np.minimum(np.minimum(np.abs(at[right] - time), np.abs(at[left] - time)), REVERSAL_S)


def _past(series: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Mean over the last `MEMORY_S` seconds, shorter at the beginning."""
    total = np.concatenate([[0.0], np.cumsum(series)])
    first = np.searchsorted(time, time - MEMORY_S)
    here = np.arange(1, len(series) + 1)
    return (total[here] - total[first]) / (here - first)


def _smooth(series: np.ndarray, time: np.ndarray, width_s: float) -> np.ndarray:
    """Moving mean over about `width_s`, so that differences of it are not mere noise."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else width_s
    half = max(0, round(0.5 * width_s / step))
    if half == 0 or len(series) <= 2 * half:
        return series
    padded = np.concatenate([np.full(half, series[0]), series, np.full(half, series[-1])])
    return np.convolve(padded, np.ones(2 * half + 1) / (2 * half + 1), mode="valid")


def sentence(name: str, maps: Sequence[ErrorMap]) -> str:
    """Say what an error depends on, and what it does not, such as `q1: largest where q1 reverses; does not depend on q2, time`."""
    telling = sorted((m for m in maps if m.depends), key=lambda m: -m.strength)
    silent = [m.against for m in maps if m.p_value > 0.2 and m.against in _plain_names(maps)]
    if not telling:
        return f"{name}: the same everywhere, as far as these data show"
    text = f"{name}: {_place(telling[0])}"
    same = telling[0].against.split(" of ")[-1]
    others = [
        m.against
        for m in telling[1:4]
        if m.strength > 0.3 * telling[0].strength and not (text.endswith(same) and m.against.endswith(f" of {same}"))
    ]
    if others:
        text += f"; also depends on {', '.join(others)}"
    return text + (f"; does not depend on {', '.join(silent[:4])}" if silent else "")


def three_digits(value: float) -> str:
    """A number to three digits, without a power of ten below a million.

    >>> three_digits(151200.0), three_digits(0.02345)
    ('151000', '0.0234')
    """
    return f"{float(f'{value:.3g}'):.6g}"


def _place(m: ErrorMap) -> str:
    """Where the error of a map stands out."""
    worst, moving = int(np.argmax(m.rms)), m.against.split(" of ")[-1]
    turning = m.against.startswith("speed of ") and m.edges[worst] <= 0 <= m.edges[worst + 1]
    if turning or (m.against.startswith("time from a reversal of ") and worst == 0):
        return f"largest where {moving} reverses"
    unit = f" {m.unit}" if m.unit not in ("", "1") else ""
    low, high = m.edges[worst], m.edges[worst + 1]
    where = f"largest where {m.against} is {three_digits(low)} to {three_digits(high)}{unit}"
    if np.sign(m.bias[0]) != np.sign(m.bias[-1]) and min(abs(m.bias[0]), abs(m.bias[-1])) > 0.3 * np.sqrt(
        np.mean(m.rms**2)
    ):
        return f"{shape(0.5 * (m.edges[:-1] + m.edges[1:]), m.bias)} {m.against}, {where}"
    return where


# The share of the variance of means from which on a shape is said in words; shares of two that differ by less do not tell.
TELLS, ALIKE = 0.85, 0.05


def shape(x: np.ndarray, means: np.ndarray) -> str:
    """How means (n,) go with the middles x (n,) of their bins: the plainest of the shapes that tells most of their variance.

    >>> x = np.array([-2.0, -1.0, 1.0, 2.0])
    >>> shape(x, -3 * x), shape(x, np.sign(x)), shape(x, x**2)
    ('falls in proportion to', 'flips with the sign of', 'changes with')
    """
    sign, line = explained(np.sign(x), means), explained(x, means)
    if max(sign, line) < TELLS:
        return "changes with"
    if sign > line + ALIKE and np.any(x > 0) and np.any(x < 0):
        return "flips with the sign of"
    way = "grows" if float(np.sum((x - x.mean()) * (means - means.mean()))) > 0 else "falls"
    # A straight line leaves next to nothing.
    return f"{way} in proportion to" if line > max(sign, 1 - ALIKE) + ALIKE / 2 else f"{way} with"


def explained(source: np.ndarray, means: np.ndarray) -> float:
    """Share of the variance of means (n,) that a multiple of the source (n,) and a constant explain."""
    if np.ptp(source) == 0 or np.ptp(means) == 0:
        return 0.0
    return float(np.corrcoef(source, means)[0, 1] ** 2)


def _plain_names(maps: Sequence[ErrorMap]) -> set[str]:
    """Coordinates that people think of first: no histories and amplitudes."""
    return {m.against for m in maps if not m.against.startswith(("history", "amplitude", "time from"))}
