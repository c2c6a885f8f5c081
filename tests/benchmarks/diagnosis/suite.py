"""Which cases a run of the benchmark has, by size, and in which order."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish
from tests.benchmarks.diagnosis.truth.library import EFFECTS, FOREIGN
from tests.benchmarks.diagnosis.truth.machines import MACHINES

SEED = 20
# The map of ENR and record length, drawn on machines that are quick to diagnose.
MAP_MACHINES = ("drive", "pendulum", "two-mass")
MAP_ENR = (0.5, 1.5, 5.0, 15.0)
MAP_SECONDS = (2.0, 5.0, 15.0)


@dataclass(frozen=True)
class Size:
    """Cases of each family on each machine, and draws for each cell of the map."""

    cases: Mapping[str, int]
    map_draws: int


SIZES = {
    "tiny": Size(dict.fromkeys(FAMILIES, 1), 0),
    "small": Size(dict.fromkeys(FAMILIES, 1) | {"S": 2, "T": 0}, 0),
    "medium": Size({"N0": 8, "N1": 6, "N2": 6, "S": 16, "D": 8, "T": 1, "O": 6, "I": 5}, 9),
    "full": Size({"N0": 30, "N1": 15, "N2": 15, "S": 60, "D": 25, "T": 8, "O": 15, "I": 9}, 100),
}


def suite(size: str, seed: int = SEED) -> list[Wish]:
    """The cases of a size, in an order in which a run that is cut short has done about the same share of everything.

    Cases of a family on a machine, and draws of a cell of the map, are spread evenly over the whole order. Cases of another
    `seed` are others of the same kinds, such as nobody has looked at yet.
    """
    wanted = SIZES[size]
    plain = [
        (_place(k, wanted.cases[family], f, m), Wish(family, machine, k, seed))
        for f, family in enumerate(FAMILIES)
        for m, machine in enumerate(MACHINES)
        for k in range(wanted.cases[family])
    ]
    drawn = [
        (_place(k, wanted.map_draws, cell, 0), wish)
        for k in range(wanted.map_draws)
        for cell, wish in enumerate(_map_cells(k, seed + 1))
    ]
    return _with_effects(wish for _, wish in sorted(plain + drawn, key=lambda entry: (entry[0], entry[1].name)))


def _with_effects(wishes: Iterable[Wish]) -> list[Wish]:
    """Single and foreign effects so that each comes as often as the others, as far as its machines allow, at any cut."""
    used: Counter[str] = Counter()
    found = []
    for wish in wishes:
        libraries = {"S": EFFECTS, "O": FOREIGN}.get(wish.family)
        if libraries is not None:
            library = libraries[wish.machine]
            order = np.random.default_rng([wish.seed, wish.index]).permutation(sorted(library))
            rarest = min(map(str, order), key=lambda name: used[name])
            used[rarest] += 1
            wish = replace(wish, effects=(rarest,))
        found.append(wish)
    return found


def _place(k: int, of: int, first: int, second: int) -> float:
    """Where the k-th of a kind comes, from 0 to 1; kinds are shifted against each other by the golden section."""
    return (k + (0.618034 * (7 * first + second)) % 1.0) / of


def _map_cells(k: int, seed: int) -> Iterator[Wish]:
    """The k-th draw of each cell; machines and effects change from cell to cell, so that a few draws see many."""
    cells = [(enr, seconds) for enr in MAP_ENR for seconds in MAP_SECONDS]
    for place, (enr, seconds) in enumerate(cells):
        machine = MAP_MACHINES[(k + place) % len(MAP_MACHINES)]
        yield Wish("S", machine, k * len(cells) + place, seed, enr=enr, seconds=seconds)
