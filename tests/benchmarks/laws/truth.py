"""Records of a plant with a hidden effect, by scipy's integrator; shares nothing with the product."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.laws.cases import Hidden
from tests.benchmarks.laws.plants import PLANTS, Plant

SAMPLES = 600


@dataclass(frozen=True)
class Truth:
    """The true states of a trial (n, nx), the input (n,), the missing force (n,), and the noise of the sensor."""

    time: np.ndarray
    states: np.ndarray
    input: np.ndarray
    force: np.ndarray
    noise: float


def record(case: Hidden, folder: Path, seed: int) -> list[Truth]:
    """Write three trials, the model and `case.toml`; what is true of each trial."""
    plant, random = PLANTS[case.plant], np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{plant.model}.mo").write_text(plant.text)
    name, unit = plant.output
    (folder / "case.toml").write_text(
        f'files = ["a.csv", "b.csv", "c.csv"]\nlearning = [1, 2]\nheld_out = [3]\n[columns]\nt = "s"\nu = "{plant.input[1]}"\n'
        f'{name} = "{unit}"\n[variables]\nt = "time"\n'
    )
    found = [_trial(plant, case, random) for _ in "abc"]
    noise = plant.noise * float(np.std(np.concatenate([t.states[:, 0] for t in found])))
    for letter, truth in zip("abc", found, strict=True):
        measured = truth.states[:, 0] + noise * random.standard_normal(SAMPLES)
        rows = np.column_stack([truth.time, truth.input, measured])
        np.savetxt(folder / f"{letter}.csv", rows, delimiter=",", header=f"t,u,{name}", comments="", fmt="%.9g")
    return [Truth(t.time, t.states, t.input, t.force, noise) for t in found]


def _trial(plant: Plant, case: Hidden, random: np.random.Generator) -> Truth:
    time = plant.step * np.arange(SAMPLES)
    waves = zip(random.uniform(plant.slow, plant.fast, 5), random.uniform(0, 6.28, 5), strict=True)
    shape = sum(np.sin(2 * np.pi * f * time + p) for f, p in waves)
    given = plant.middle + plant.amplitude * shape / np.std(shape)
    if plant.middle > 0 and plant.states == ("h",):
        given = np.maximum(given, 0.0)

    def force(t: float, y: np.ndarray, u: float) -> float:
        return case.force(t, *_place(plant, y), u, y[-1])

    def rates(t: float, y: np.ndarray) -> list[float]:
        u = float(np.interp(t, time, given))
        z = 0.0 if case.memory is None else case.memory(t, *_place(plant, y), u, y[-1])
        return [*plant.rates(u, y[:-1], force(t, y, u)), z]

    run = solve_ivp(rates, (0, time[-1]), [*plant.start, 0.0], t_eval=time, rtol=1e-7, atol=1e-9, max_step=plant.step)
    states = run.y.T
    forces = np.array([force(t, y, u) for t, y, u in zip(time, states, given, strict=True)])
    return Truth(time, states[:, :-1], given, forces, 0.0)


def _place(plant: Plant, y: np.ndarray) -> tuple[float, float]:
    """Position and speed of the balance that is hit; of a store its quantity, and no speed."""
    if len(plant.start) == 1:
        return float(y[0]), 0.0
    position = 1 - plant.hit
    return float(y[position]), float(y[plant.hit])
