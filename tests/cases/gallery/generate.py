"""Record the gallery's machines by programs of their own: `python tests/cases/gallery/generate.py`.

Each machine is written here a second time, in plain NumPy and SciPy with numbers of its own, so nothing is shared with the
models under test. A case holds what the model lacks, its `_null` the machine as the model says. Sensors have noise and a
resolution; commands are held between their updates, as a controller holds them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
TRIALS, HELD_OUT = 5, 2
Right = Callable[[float, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Sensor:
    """A column: its unit, the standard deviation of its noise and the step that it is rounded to (0: none)."""

    name: str
    unit: str
    noise: float = 0.0
    resolution: float = 0.0


@dataclass(frozen=True)
class Machine:
    """A plant: commands held over `hold` samples, `start(random)`, `right(t, x, u)`, `read(x, u)` in the order of sensors."""

    class_name: str
    rate_hz: float
    samples: int
    commands: tuple[Sensor, ...]
    sensors: tuple[Sensor, ...]
    command: Callable[[np.random.Generator, int], np.ndarray]
    start: Callable[[np.random.Generator], np.ndarray]
    right: Callable[[bool], Right]
    read: Callable[[np.ndarray, np.ndarray], np.ndarray]
    note: str
    follow: Callable[[np.ndarray, np.ndarray, float, bool], np.ndarray] | None = None


def steps(random: np.random.Generator, samples: int, hold: tuple[int, int], low: float, high: float) -> np.ndarray:
    """Levels between two limits, each held for a random number of samples."""
    found: list[float] = []
    while len(found) < samples:
        found += [random.uniform(low, high)] * int(random.integers(*hold))
    return np.array(found[:samples])


def swings(random: np.random.Generator, samples: int, rate_hz: float, top_hz: float, size: float) -> np.ndarray:
    """A sum of sines below a frequency, with a root mean square of about `size`."""
    t = np.arange(samples) / rate_hz
    frequencies = random.uniform(0.05 * top_hz, top_hz, 12)
    phases = random.uniform(0, 2 * np.pi, 12)
    return size * np.sqrt(2 / 12) * np.sin(2 * np.pi * frequencies * t[:, None] + phases).sum(axis=1)


def integrate(machine: Machine, effect: bool, u: np.ndarray, start: np.ndarray) -> np.ndarray:
    """States at the samples; a command holds from its sample to the next."""
    if machine.follow is not None:
        return machine.follow(u, start, machine.rate_hz, effect)
    right, step = machine.right(effect), 1.0 / machine.rate_hz
    states, changes = [start], [0, *(np.flatnonzero(np.any(np.diff(u, axis=0) != 0, axis=1)) + 1), len(u) - 1]
    for first, last in zip(changes, changes[1:], strict=False):
        if last == first:
            continue
        times = np.arange(first, last + 1) * step
        # Scales of states differ by 1e9; so the tolerance is relative to what each one is.
        done = solve_ivp(
            right, (times[0], times[-1]), states[-1], "LSODA", times, args=(u[first],), rtol=1e-9, atol=1e-10
        )
        assert done.success, done.message
        states.extend(done.y.T[1:])
    return np.array(states)


def smooth_integrate(machine: Machine, effect: bool, u: np.ndarray, start: np.ndarray) -> np.ndarray:
    """States for a command that changes at every sample, such as a measured road: straight lines between samples."""
    right, times = machine.right(effect), np.arange(len(u)) / machine.rate_hz

    def driven(t: float, x: np.ndarray) -> np.ndarray:
        return right(t, x, np.array([np.interp(t, times, column) for column in u.T]))

    done = solve_ivp(driven, (0, times[-1]), start, "RK45", times, rtol=1e-8, atol=1e-10, max_step=times[1])
    return np.asarray(done.y.T)


# Quarter car: the damper takes less in bump than in rebound; the model has one number for both.
def quarter_car(effect: bool) -> Right:
    bump, rebound = (900.0, 2000.0) if effect else (1450.0, 1450.0)

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        body, body_speed, wheel, wheel_speed = x
        closing = body_speed - wheel_speed
        strut = 21e3 * (body - wheel) + (rebound if closing > 0 else bump) * closing
        return np.array([body_speed, -strut / 310, wheel_speed, (strut - 19e4 * (wheel - u[0])) / 38])

    return right


def motor_with_friction(u: np.ndarray, start: np.ndarray, rate_hz: float, effect: bool) -> np.ndarray:
    """Geared motor with Coulomb friction at the load, time steps of 20 us, sticking included.

    Per step the friction's impulse is what stops the load, up to its limit (Moreau's time stepping).
    """
    pieces = round(1.0 / (rate_hz * 2e-5))
    h, inertia, limit = 1.0 / (rate_hz * pieces), 9.5e-3 + 144 * 2.4e-5, 0.09 if effect else 0.0
    current, angle, speed = start
    states = [start]
    for volts in u[:-1, 0]:
        for _ in range(pieces):
            current += h * (volts - 1.9 * current - 0.052 * 12 * speed) / 1.2e-3
            free = speed + h / inertia * (12 * 0.052 * current - 8e-3 * speed - 0.35 * np.sin(angle))
            stop = np.clip(-free, -limit * h / inertia, limit * h / inertia)
            speed = free + stop
            angle += h * speed
        states.append(np.array([current, angle, speed]))
    return np.array(states)


# Overhead crane: bending the rope over its sheave costs a torque that goes with the speed of the rope's angle.
def crane(effect: bool) -> Right:
    rope = 55.0 if effect else 0.0

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        _, angle, speed, rate = x
        coupling = 65 * 3.2 * np.cos(angle)
        mass = np.array([[185.0, coupling], [coupling, 65 * 3.2**2]])
        force = u[0] - 45 * speed + 65 * 3.2 * rate**2 * np.sin(angle)
        torque = -65 * 9.81 * 3.2 * np.sin(angle) - rope * rate
        return np.array([speed, rate, *np.linalg.solve(mass, [force, torque])])

    return right


# Two rooms: the bedroom's floor lies on the ground, which has 10 degC all year.
def rooms(effect: bool) -> Right:
    ground = 9.0 if effect else 0.0

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        living, bedroom = x
        between = 55 * (living - bedroom)
        return np.array(
            [
                (u[0] - between - 38 * (living - u[1])) / 2.6e6,
                (between - 24 * (bedroom - u[1]) - ground * (bedroom - 283.15)) / 1.9e6,
            ]
        )

    return right


def open_circuit(charge: float | np.ndarray) -> float | np.ndarray:
    """Voltage of the cell without load."""
    return 3.05 + charge * (1.55 + charge * (-1.15 + 0.72 * charge)) - 0.12 * np.exp(-35 * charge)


# Battery: a second, slow polarisation (0.016 Ohm, 640 s).
def cell(effect: bool) -> Right:
    slow = 0.016 if effect else 0.0

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        _, fast, late = x
        return np.array([-u[0] / 9000, (0.019 * u[0] - fast) / (0.019 * 1350), (slow * u[0] - late) / 640])

    return right


# Reactor: fouling grows on the jacket from clean; its resistance after an hour is as large as that of the clean wall.
def reactor(effect: bool) -> Right:
    growth = 1.0 / (5200 * 3600) if effect else 0.0

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        temperature, concentration = x
        reaction = 1.2e9 * np.exp(-8750 / temperature) * concentration * 0.1
        jacket = (u[1] - temperature) / (1 / 5200 + growth * t)
        heat = u[0] * 4.1e6 * (340 - temperature) + 5e4 * reaction + jacket
        return np.array([heat / 4.1e5, (u[0] * (1000 - concentration) - reaction) / 0.1])

    return right


# Cylinder: oil passes the piston's worn ring.
def cylinder(effect: bool) -> Right:
    leak = 3.0e-12 if effect else 0.0

    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        place, piston, ring, speed = x
        supply, tank = 12e6, 2e5
        into, out = (supply - piston, ring - tank) if u[0] > 0 else (piston - tank, supply - ring)
        flow = 9.5e-8 * u[0] * np.sqrt(np.maximum([into, out], 1.0))
        passed = leak * (piston - ring)
        return np.array(
            [
                speed,
                1.1e9 * (flow[0] - 1.96e-3 * speed - passed) / (2.5e-4 + 1.96e-3 * place),
                1.1e9 * (-flow[1] + 1.0e-3 * speed + passed) / (4.5e-4 - 1.0e-3 * place),
                (1.96e-3 * piston - 1.0e-3 * ring - 1800 * speed - u[1]) / 85,
            ]
        )

    return right


# Converter: the core saturates, which takes the inductance to half at 14 A.
def buck(effect: bool) -> Right:
    def right(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        voltage, current = x
        inductance = 47e-6 / (1 + (current / 14.0) ** 2) if effect else 47e-6
        return np.array([(current - voltage / 2.2) / 220e-6, (u[0] * u[1] - 0.045 * current - voltage) / inductance])

    return right


def cylinder_start(random: np.random.Generator) -> np.ndarray:
    ring = random.uniform(3e6, 5e6)
    return np.array([random.uniform(0.05, 0.2), ring * 1.0 / 1.96, ring, 0.0])


def cylinder_command(random: np.random.Generator, n: int) -> np.ndarray:
    """Out and in about the middle of the stroke, under a load that is held for a while."""
    wave = 0.5 * np.sin(2 * np.pi * np.arange(n) / random.uniform(250, 400)) + swings(random, n, 500, 4, 0.12)
    held = np.repeat(wave[::5], 5)[:n]
    return np.column_stack([np.clip(held, -1, 1), steps(random, n, (150, 400), -1500, 2500)])


def house_command(random: np.random.Generator, n: int) -> np.ndarray:
    """A heater that is switched every quarter of an hour, and a day outside in steps of a slow logger."""
    hours = np.arange(n) / 20
    outside = 278.15 + random.uniform(-4, 4) + 4 * np.sin(2 * np.pi * (hours - 9) / 24) + 0.4 * random.standard_normal()
    heater = 2200.0 * (steps(random, n, (5, 40), 0, 1) < 0.55)
    return np.column_stack([heater, np.round(np.repeat(outside[::5], 5)[:n], 1)])


MACHINES = {
    "quarter_car": Machine(
        "QuarterCar",
        200.0,
        1200,
        (Sensor("zr", "m"),),
        (Sensor("travel", "m", 1e-4, 5e-5), Sensor("height", "m", 1e-4)),
        lambda random, n: swings(random, n, 200.0, 7.0, 0.012)[:, None],
        lambda random: np.zeros(4),
        quarter_car,
        lambda x, u: np.column_stack([x[:, 0] - x[:, 2], x[:, 0]]),
        "shaker test; the road is the measured height of the shaker",
    ),
    "geared_motor": Machine(
        "GearedMotor",
        200.0,
        1000,
        (Sensor("u", "V"),),
        (Sensor("angle", "rad", 0.0, 2 * np.pi / 4096), Sensor("current", "A", 0.01, 0.005)),
        lambda random, n: np.round(steps(random, n, (20, 80), -6, 6), 2)[:, None],
        lambda random: np.zeros(3),
        lambda effect: lambda t, x, u: x,
        lambda x, u: x[:, [1, 0]],
        "voltage held by the drive; encoder of 4096 counts at the load",
        follow=motor_with_friction,
    ),
    "overhead_crane": Machine(
        "Crane",
        50.0,
        1000,
        (Sensor("F", "N"),),
        (Sensor("x", "m", 5e-4, 1e-3), Sensor("phi", "rad", 1e-3)),
        lambda random, n: np.round(steps(random, n, (40, 120), -120, 120))[:, None],
        lambda random: np.array([0.0, random.uniform(-0.15, 0.15), 0.0, 0.0]),
        crane,
        lambda x, u: x[:, :2],
        "drive force held by the drive; rope angle by a camera",
    ),
    "two_rooms": Machine(
        "House.Plant",
        1 / 180.0,
        960,
        (Sensor("P", "W"), Sensor("Ta", "K")),
        (Sensor("T1", "K", 0.03, 0.05), Sensor("T2", "K", 0.03, 0.05)),
        house_command,
        lambda random: random.uniform(289.15, 294.15, 2),
        rooms,
        lambda x, u: x,
        "two days each, a row every three minutes; thermometers of 0.05 K",
    ),
    "battery": Machine(
        "Cell",
        1.0,
        2400,
        (Sensor("I", "A"),),
        (Sensor("U", "V", 4e-4, 1e-3),),
        lambda random, n: np.round(np.maximum(steps(random, n, (20, 240), -2.5, 5), -1.5), 1)[:, None],
        lambda random: np.array([random.uniform(0.75, 0.92), 0.0, 0.0]),
        cell,
        lambda x, u: (open_circuit(x[:, 0]) - 0.031 * u[:, 0] - x[:, 1] - x[:, 2])[:, None],
        "drive cycle of 40 minutes after rest, current held over each second, voltmeter of 1 mV",
    ),
    "reactor": Machine(
        "Reactor",
        0.2,
        1080,
        (Sensor("q", "m3/s"), Sensor("Tj", "K")),
        (Sensor("T", "K", 0.05, 0.0), Sensor("cA", "mol/m3", 4.0, 0.0)),
        lambda random, n: np.column_stack(
            [
                np.round(steps(random, n, (60, 200), 1.1e-3, 1.8e-3), 6),
                np.round(steps(random, n, (60, 200), 300, 309), 1),
            ]
        ),
        lambda random: np.array([random.uniform(340, 348), random.uniform(550, 750)]),
        reactor,
        lambda x, u: x,
        "campaigns of 90 minutes, each from a clean jacket; set points held",
    ),
    "cylinder": Machine(
        "Cylinder",
        500.0,
        1200,
        (Sensor("y", "1"), Sensor("F", "N")),
        (Sensor("x", "m", 5e-5, 1e-5), Sensor("p_1", "Pa", 8e3, 0.0), Sensor("p_2", "Pa", 8e3, 0.0)),
        cylinder_command,
        cylinder_start,
        cylinder,
        lambda x, u: x[:, :3],
        "valve command held over 10 ms, load cell beside the rod",
    ),
    "buck": Machine(
        "Buck",
        2e5,
        1000,
        (Sensor("d", "1"), Sensor("Vin", "V")),
        (Sensor("v", "V", 5e-3, 2e-3), Sensor("i", "A", 0.02, 0.01)),
        lambda random, n: np.column_stack([np.round(steps(random, n, (60, 180), 0.2, 0.85), 3), np.full(n, 24.0)]),
        lambda random: np.array([random.uniform(4, 8), random.uniform(2, 4)]),
        buck,
        lambda x, u: x,
        "load steps of the duty cycle; one sample in each switching period",
    ),
}


def write(name: str, machine: Machine, effect: bool) -> None:
    """Write the trials of one case and their `case.toml`."""
    folder = HERE / (name if effect else f"{name}_null")
    folder.mkdir(exist_ok=True)
    random = np.random.default_rng([sum(map(ord, name)), int(effect)])
    time = np.arange(machine.samples) / machine.rate_hz
    columns = [*machine.commands, *machine.sensors]
    for number in range(1, TRIALS + 1):
        u = machine.command(random, machine.samples)
        run = smooth_integrate if name == "quarter_car" else integrate
        states = run(machine, effect, u, machine.start(random))
        values = np.column_stack([u, machine.read(states, u)])
        rows = [time]
        for sensor, column in zip(columns, values.T, strict=True):
            read = column + sensor.noise * random.standard_normal(len(column))
            rows.append(np.round(read / sensor.resolution) * sensor.resolution if sensor.resolution else read)
        header = ",".join(["time", *(sensor.name for sensor in columns)])
        np.savetxt(folder / f"trial_{number}.csv", np.column_stack(rows), "%.6g", ",", header=header, comments="")
    (folder / "case.toml").write_text(case_text(machine, columns))


def case_text(machine: Machine, columns: list[Sensor]) -> str:
    learning = list(range(1, TRIALS - HELD_OUT + 1))
    units = "".join(f'{sensor.name} = "{sensor.unit}"\n' for sensor in columns)
    files = ", ".join(f'"trial_{number}.csv"' for number in range(1, TRIALS + 1))
    held_out = list(range(TRIALS - HELD_OUT + 1, TRIALS + 1))
    return (
        f"# {machine.note}; written by generate.py\nfiles = [{files}]\nlearning = {learning}\nheld_out = {held_out}\n\n"
        f'[columns]\ntime = "s"\n{units}'
    )


if __name__ == "__main__":
    for case, plant in MACHINES.items():
        for with_effect in (True, False):
            write(case, plant, with_effect)
