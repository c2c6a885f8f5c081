"""Records of machines for the tests of the data checks, integrated by SciPy, which shares nothing with the product."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

DRIVE_J = 0.02
POLE = {"m": 0.147585, "a": 0.147755, "I": 1.0912e-4, "g": 9.81001}


def drive(seed: int, seconds: float = 4.0, rate_hz: float = 100.0, friction: float = 0.0) -> dict[str, np.ndarray]:
    """An inertia under a torque of some sines, with viscous friction in N.m.s/rad, sampled with noise of 1e-4 rad."""
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    sines = [(random.uniform(0.5, 3.0), random.uniform(0, 6.28), random.uniform(0.05, 0.2)) for _ in range(3)]

    def torque(t: float | np.ndarray) -> np.ndarray:
        return np.sum([size * np.sin(6.28 * hertz * t + phase) for hertz, phase, size in sines], axis=0)

    run = solve_ivp(
        lambda t, x: [x[1], (torque(t) - friction * x[1]) / DRIVE_J],
        (0, time[-1]),
        [0.3, 0.0],
        t_eval=time,
        rtol=1e-9,
        atol=1e-10,
    )
    return {"time": time, "torque": torque(time), "phi": run.y[0] + 1e-4 * random.normal(size=len(time))}


def rubbing_slide(number: int, dry: float = 0.8, lead: float = 0.0) -> dict[str, np.ndarray]:
    """A mass of 2 kg on a spring of 20 N/m with 0.4 N.s/m and dry friction in N, driven by a sine of about 0.7 Hz that is read
    `lead` s late, sampled with noise of 1e-4 m."""
    hertz, size = 0.7 * (1 + 0.03 * number), 3.0 * (1 + 0.1 * number)
    time = np.arange(600) / 100

    def force(t: float | np.ndarray) -> np.ndarray:
        return np.asarray(size * np.sin(2 * np.pi * hertz * t + number))

    run = solve_ivp(
        lambda t, x: [x[1], (force(t + lead) - 0.4 * x[1] - dry * np.tanh(x[1] / 1e-3) - 20 * x[0]) / 2],
        (0, time[-1]),
        [0.0, 0.0],
        t_eval=time,
        method="LSODA",
        rtol=1e-7,
        atol=1e-9,
        max_step=0.01,
    )
    noise = 1e-4 * np.random.default_rng(number).normal(size=len(time))
    return {"time": time, "F": force(time), "x": run.y[0] + noise}


def pendulum(seed: int, seconds: float = 4.0, rate_hz: float = 100.0, damping: float = 0.0) -> dict[str, np.ndarray]:
    """A free swing of the built-in pendulum (theta is pi when it hangs), with viscous damping in N.m.s/rad, sampled with noise
    of 1e-4 rad."""
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    inertia = POLE["I"] + POLE["m"] * POLE["a"] ** 2
    weight = POLE["m"] * POLE["g"] * POLE["a"]
    run = solve_ivp(
        lambda t, x: [x[1], -(weight * np.sin(x[0]) + damping * x[1]) / inertia],
        (0, time[-1]),
        [random.uniform(0.8, 1.4), 0.0],
        t_eval=time,
        rtol=1e-9,
        atol=1e-10,
    )
    return {"time": time, "theta": np.pi + run.y[0] + 1e-4 * random.normal(size=len(time))}


def write_case(
    folder: Path,
    machine: Callable[[int], dict[str, np.ndarray]],
    units: Mapping[str, str],
    spoil: Callable[[dict[str, np.ndarray], int], dict[str, np.ndarray]] = lambda columns, number: columns,
    trials: int = 4,
) -> Path:
    """Write trials of a machine, spoilt as wished, the last one held out; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"trial_{k}.csv" for k in range(1, trials + 1)]
    for k, name in enumerate(names, 1):
        columns = spoil(machine(k), k)
        rows = np.column_stack(list(columns.values()))
        np.savetxt(folder / name, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    listed = ", ".join(f'"{name}"' for name in names)
    lines = [f"files = [{listed}]", f"learning = {list(range(1, trials))}", f"held_out = [{trials}]", "[columns]"]
    lines += [f'{name} = "{unit}"' for name, unit in {"time": "s", **units}.items()]
    (folder / "case.toml").write_text("\n".join(lines) + "\n")
    return folder
