"""Records of a plant with a hidden effect, by scipy's integrator; shares nothing with the product."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.laws.cases import Hidden
from tests.benchmarks.laws.plants import PLANTS, Plant

SAMPLES = 600


@dataclass(frozen=True)
class Truth:
    """The true states of a trial (n, nx), the input (n,), the missing force (n,), and the noise of each sensor."""

    time: np.ndarray
    states: np.ndarray
    input: np.ndarray
    force: np.ndarray
    noise: Mapping[str, float]


def record(case: Hidden, folder: Path, seed: int) -> list[Truth]:
    """Write three trials, the model and `case.toml`; what is true of each trial."""
    plant, random = PLANTS[case.plant], np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{plant.model}.mo").write_text(plant.text)
    units = {name: unit for name, unit, _ in plant.states if name in plant.outputs}
    columns = "".join(f'{name} = "{unit}"\n' for name, unit in ({"t": "s", "u": plant.input[1]} | units).items())
    (folder / "case.toml").write_text(
        'files = ["a.csv", "b.csv", "c.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
        f'[columns]\n{columns}[variables]\nt = "time"\n'
    )
    found = [_trial(plant, case, random) for _ in "abc"]
    shown = {name: plant.names.index(name) for name in units}
    spread = np.std(np.concatenate([trial.states for trial in found]), axis=0)
    noise = {name: plant.noise * float(spread[k]) for name, k in shown.items()}
    for letter, truth in zip("abc", found, strict=True):
        measured = [truth.states[:, k] + noise[name] * random.standard_normal(SAMPLES) for name, k in shown.items()]
        rows = np.column_stack([truth.time, truth.input, *measured])
        header = ",".join(["t", "u", *shown])
        np.savetxt(folder / f"{letter}.csv", rows, delimiter=",", header=header, comments="", fmt="%.9g")
    return [Truth(t.time, t.states, t.input, t.force, noise) for t in found]


def _trial(plant: Plant, case: Hidden, random: np.random.Generator) -> Truth:
    time = plant.step * np.arange(SAMPLES)
    waves = zip(random.uniform(plant.slow, plant.fast, 5), random.uniform(0, 6.28, 5), strict=True)
    shape = sum(np.sin(2 * np.pi * f * time + p) for f, p in waves)
    given = np.maximum(plant.middle + plant.amplitude * shape / np.std(shape), plant.low)
    signs = case.at or {plant.hit: 1}

    def force(t: float, y: np.ndarray, u: float) -> float:
        return case.force(t, *_place(plant, case, y), u, y[-1])

    def rates(t: float, y: np.ndarray) -> list[float]:
        u = float(np.interp(t, time, given))
        z = 0.0 if case.memory is None else case.memory(t, *_place(plant, case, y), u, y[-1])
        pushed = force(t, y, u)
        return [*plant.rates(u, y[:-1], {state: sign * pushed for state, sign in signs.items()}), z]

    start = [*(value for _, _, value in plant.states), 0.0]
    run = solve_ivp(rates, (0, time[-1]), start, t_eval=time, rtol=1e-7, atol=1e-9, max_step=plant.step)
    states = run.y.T
    forces = np.array([force(t, y, u) for t, y, u in zip(time, states, given, strict=True)])
    return Truth(time, states[:, :-1], given, forces, {})


def _place(plant: Plant, case: Hidden, y: np.ndarray) -> tuple[np.ndarray | float, float]:
    """Position and speed of the balance that is hit; of a store its quantity, and no speed."""
    if case.whole:
        return y[:-1], 0.0
    return float(y[0]), float(y[1]) if len(plant.states) > 1 else 0.0
