"""The same records through PySINDy, in an environment of its own: `python -m tests.benchmarks.laws.sindy RESULTS.jsonl`; the product is not needed.

The missing force is what the balance lacks with rates by Savitzky and Golay's filter (15 samples, cubic), which is what a user of
PySINDy has. Its library: polynomials of position, speed and input, and their magnitudes and signs; degree (1 to 5) and
threshold of sequentially thresholded least squares are chosen by the second learning trial. No units, and no hidden states.
"""

import json
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
import pysindy as ps
from scipy.signal import savgol_filter

from tests.benchmarks.laws.cases import CASES, Hidden
from tests.benchmarks.laws.plants import PLANTS, Plant
from tests.benchmarks.laws.truth import Truth, record

DEGREES = (1, 2, 3, 5)
THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
WINDOW = 15


def off(case: Hidden, seed: int = 0) -> float:
    """Error of the force along the true held-out trial as a share of the true one (rms)."""
    plant = PLANTS[case.plant]
    with tempfile.TemporaryDirectory() as name:
        truth = record(case, Path(name), seed)
        tables = [np.loadtxt(Path(name) / f"{letter}.csv", delimiter=",", skiprows=1) for letter in "abc"]
    first, second, _ = (_estimated(plant, table) for table in tables)
    scale = np.maximum(np.abs(first[0]).max(axis=0), 1e-12)
    size = float(np.std(first[1])) or 1.0
    best, least = None, np.inf
    for degree, threshold in product(DEGREES, THRESHOLDS):
        own = ps.CustomLibrary([lambda x: np.abs(x), lambda x: np.sign(x)], [lambda n: f"|{n}|", lambda n: f"sign {n}"])
        library = ps.PolynomialLibrary(degree=degree) + own
        model = ps.SINDy(optimizer=ps.STLSQ(threshold=threshold, alpha=1e-6), feature_library=library)
        model.fit(first[0] / scale, t=plant.step, x_dot=np.tile(first[1][:, None] / size, (1, first[0].shape[1])))
        error = float(np.mean((model.predict(second[0] / scale)[:, 0] * size - second[1]) ** 2))
        if error < least:
            best, least = model, error
    assert best is not None
    force = best.predict(_features(plant, truth[2]) / scale)[:, 0] * size
    return float(np.sqrt(np.mean((force - truth[2].force) ** 2) / max(np.mean(truth[2].force ** 2), 1e-300)))


def _estimated(plant: Plant, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Features (n, k) and the missing force (n,) by differences of the measured signal."""
    u, y = table[:, 1], table[:, 2]
    smooth, rate, second = (savgol_filter(y, WINDOW, 3, deriv=k, delta=plant.step) for k in range(3))
    inner = slice(WINDOW, -WINDOW)
    if len(plant.states) == 1:
        states, top = [smooth], rate
    elif plant.hit in plant.outputs:
        states, top = [np.cumsum(smooth) * plant.step, smooth], rate
    else:
        states, top = [smooth, rate], second
    hit = plant.names.index(plant.hit)
    without = np.array([plant.rates(a, list(s), {})[hit] for a, s in zip(u, np.column_stack(states), strict=True)])
    rest = [0.0] * len(plant.states)
    gain = plant.rates(0.0, rest, {plant.hit: 1.0})[hit] - plant.rates(0.0, rest, {})[hit]
    return np.column_stack([*states, u])[inner], ((top - without) / gain)[inner]


def _features(plant: Plant, truth: Truth) -> np.ndarray:
    return np.column_stack([truth.states, truth.input])


if __name__ == "__main__":
    rows = [json.loads(line) for file in sys.argv[1:] for line in Path(file).read_text().splitlines()]
    seeds = {row["case"]: row["seed"] for row in rows}
    # Of plants with several balances PySINDy would have to be told which states there are.
    cases = {f"{c.plant}: {c.name}": c for c in CASES if not c.whole and c.name != "nothing"}
    found = {name: off(c, seeds[name]) for name, c in cases.items() if name in seeds}
    for name, error in found.items():
        print(f"{name}: off {error:.1%}")
    print(f"within 5 %: {sum(e <= 0.05 for e in found.values())} of {len(found)}")
