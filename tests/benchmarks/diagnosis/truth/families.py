"""The families of cases: what is hidden in the truth of each, drawn from one seed."""

import zlib
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Context
from tests.benchmarks.diagnosis.truth.excitation import Plan, plan_trial
from tests.benchmarks.diagnosis.truth.idle import hidden_effect, idle_plan
from tests.benchmarks.diagnosis.truth.library import EFFECTS, FOREIGN, confusable_pairs
from tests.benchmarks.diagnosis.truth.machines import MACHINES, Machine
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.truth.nearest import beyond_smaller_sets, left_by_library
from tests.benchmarks.diagnosis.truth.run import Injection, run_trial
from tests.benchmarks.diagnosis.truth.sensors import LEVELS, Recorder
from tests.benchmarks.diagnosis.truth.size import sized_to
from tests.benchmarks.diagnosis.truth.yardstick import Yardstick

FAMILIES = {
    "N0": "nothing missing, parameters exact",
    "N1": "nothing missing, parameters off by up to 5 %",
    "N2": "nothing missing, ugly noise",
    "S": "one effect",
    "D": "two effects, 30 % of the pairs easily confused",
    "T": "three effects",
    "O": "an effect that is in no library",
    "I": "an effect that the data cannot show",
}
TOLERANCE = 0.05
TRIALS = 6
HELD_OUT = (5, 6)
SINGLE_ENR = (10.0, 3.0, 30.0, 1.0)
SET_ENR = (10.0, 3.0, 30.0)
# What a set does beyond any smaller one, or what is in no library beyond any of its effects, each in any size: with less, no
# record tells that there is more.
LEAST_BEYOND = 0.5
CONFUSED_SHARE = 0.3
# Sets in all, where effects that go together are drawn until some do.
REDRAWS = 5


@dataclass(frozen=True)
class Wish:
    """What is asked of a case: `enr` and `noise` are drawn where None; trials last `seconds` (times the machine's slowness)."""

    family: str
    machine: str
    index: int
    seed: int
    enr: float | None = None
    noise: str | None = None
    seconds: float = 10.0
    effects: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the case, unique within a benchmark of one seed."""
        parts = [self.family, self.machine, f"{self.index:03d}"]
        parts += [f"enr{self.enr:g}"] if self.enr is not None else []
        parts += [f"{self.seconds:g}s"] if self.seconds != 10.0 else []
        return "_".join(parts)


@dataclass(frozen=True, eq=False)
class Drawn:
    """A case before it is recorded."""

    wish: Wish
    machine: Machine
    plans: tuple[Plan, ...]
    injections: tuple[Injection, ...]
    recorder: Recorder
    noise: np.ndarray
    changed: dict[str, float] = field(default_factory=dict)
    enr: float = 0.0
    enr_each: tuple[float, ...] = ()
    kind: str = ""
    enr_left: float | None = None


def draw_case(wish: Wish) -> Drawn:
    """Draw a case; the same wish gives the same case on any machine."""
    if wish.family not in FAMILIES:
        raise ValueError(f"family {wish.family!r} is none of {', '.join(FAMILIES)}")
    machine = MACHINES[wish.machine]
    random = np.random.default_rng([wish.seed, wish.index, zlib.crc32(f"{wish.family} {wish.machine}".encode())])
    hidden = int(random.integers(6))
    if wish.family == "I":
        plans = tuple(idle_plan(machine, k, wish.seconds, hidden, random) for k in range(TRIALS))
    else:
        plans = tuple(plan_trial(machine, k, wish.seconds, random) for k in range(TRIALS))
    runs = [run_trial(machine, plan) for plan in plans]
    level = wish.noise or LEVELS[int(random.integers(len(LEVELS)))]
    recorder = Recorder.of(machine, level, runs, ugly=wish.family == "N2")
    context = Context(machine, random, tuple(runs))
    yardstick = Yardstick.of(machine, plans, runs, recorder, random)
    learning = yardstick.in_trials([k for k in range(TRIALS) if k + 1 not in HELD_OUT])
    injections: list[Injection] = []
    each, kind, left = list[float](), "", None
    changed = _tolerances(machine, random) if wish.family == "N1" else {}
    if wish.family == "I":
        effect, size = hidden_effect(context, hidden, recorder.std)
        injections = [effect(size)]
    elif wish.family == "O":
        kind, found, enr, left = _outside(context, wish, yardstick, learning)
        injections, each = [found], [enr]
    else:
        injections, each = _inside(context, wish, yardstick, learning)
    total = yardstick.enr(injections) if injections else 0.0
    return Drawn(
        wish, machine, plans, tuple(injections), recorder, yardstick.noise, changed, total, tuple(each), kind, left
    )


def _inside(
    context: Context, wish: Wish, yardstick: Yardstick, learning: Yardstick
) -> tuple[list[Injection], list[float]]:
    """Effects of the library and their ENR; others where none fits beside the first, which learning trials hardly show."""
    for attempt in range(REDRAWS):
        injections, each = list[Injection](), list[float]()
        try:
            for name in _names(wish, context.machine, context.random):
                wanted = _enr(wish, SINGLE_ENR if wish.family == "S" else SET_ENR)
                found, enr = _apart(context, name, wanted, yardstick, learning, injections)
                injections.append(found)
                each.append(enr)
        except TruthError:
            if attempt == REDRAWS - 1:
                raise
        else:
            break
    return injections, each


def _outside(
    context: Context, wish: Wish, yardstick: Yardstick, learning: Yardstick
) -> tuple[str, Injection, float, float]:
    """An effect of no library, its kind and ENR, and the ENR that no library effect imitates, which learning trials must show."""
    name, wanted = context.machine.name, _enr(wish, SET_ENR)
    first = _choose(FOREIGN[name], wish)
    kinds = (first, *(other for other in sorted(FOREIGN[name]) if other != first and not wish.effects))
    larger = [enr for enr in sorted(SET_ENR) if enr > wanted and wish.enr is None]
    best = ("", Injection("", "", {}), 0.0, -1.0)
    for size, kind in product((wanted, *larger), kinds):
        found, enr = sized_to(FOREIGN[name][kind](context), size, yardstick)
        left = left_by_library(context, EFFECTS[name], found, learning)
        if left > best[3]:
            best = (kind, found, enr, left)
        if left >= LEAST_BEYOND:
            break
    return best


def _enr(wish: Wish, cycle: tuple[float, ...]) -> float:
    return wish.enr if wish.enr is not None else cycle[wish.index % len(cycle)]


def _choose(library: dict[str, object], wish: Wish) -> str:
    if wish.effects:
        return wish.effects[0]
    # Every machine has an order of its own; effects and sizes cycle with different periods, so that all meet.
    order = np.random.default_rng([wish.seed, zlib.crc32(wish.machine.encode())]).permutation(sorted(library))
    return str(order[(wish.index + wish.index // len(order)) % len(order)])


def _names(wish: Wish, machine: Machine, random: np.random.Generator) -> tuple[str, ...]:
    if wish.effects or wish.family in ("N0", "N1", "N2"):
        return wish.effects
    library = EFFECTS[machine.name]
    if wish.family == "S":
        return (_choose(dict.fromkeys(library), wish),)
    pairs = confusable_pairs(machine)
    if wish.family == "D" and pairs and random.random() < CONFUSED_SHARE:
        return pairs[int(random.integers(len(pairs)))]
    return tuple(random.choice(sorted(library), 2 if wish.family == "D" else 3, replace=False))


def _apart(
    context: Context, name: str, wanted: float, yardstick: Yardstick, learning: Yardstick, others: list[Injection]
) -> tuple[Injection, float]:
    """The effect at the wanted size, which no other one imitates; effects of one kind at one joint share a value."""
    taken = {key for other in others for key in other.values}
    machine = context.machine
    library = EFFECTS[machine.name]
    best: tuple[Injection, float] | None = None
    for attempt in range(20):
        found, enr = sized_to(library[name](context), wanted, yardstick)
        shows = not others or beyond_smaller_sets([*others, found], learning) >= LEAST_BEYOND
        if shows and not taken & found.values.keys():
            if best is None or best[1] < enr:
                best = (found, enr)
            # An end stop may throw a machine where it never meets the stop again; another one may not.
            if best[1] > wanted / 1.5 or attempt >= 3:
                return best
        elif attempt >= 4:
            name = sorted(library)[int(context.random.integers(len(library)))]
            if name in {other.id for other in others}:
                name = "joint_scale"
    raise TruthError(f"{machine.name}: no effect fits beside {', '.join(other.id for other in others)}")


def _tolerances(machine: Machine, random: np.random.Generator) -> dict[str, float]:
    return {
        name: machine.values[name] * (1 + random.uniform(-TOLERANCE, TOLERANCE)) for name in sorted(machine.tolerances)
    }
