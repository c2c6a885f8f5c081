"""Which cases a run of the benchmark has, by size."""

from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish
from tests.benchmarks.diagnosis.truth.machines import MACHINES

SEED = 20
# Cases of each family and machine.
COUNTS = {
    "small": dict.fromkeys(FAMILIES, 1) | {"S": 2, "T": 0},
    "medium": dict.fromkeys(FAMILIES, 3) | {"S": 8, "D": 4, "T": 1},
    "full": {"N0": 30, "N1": 15, "N2": 15, "S": 60, "D": 25, "T": 8, "O": 15, "I": 9},
}
# The map of ENR and record length, drawn on machines that are quick to diagnose.
MAP_MACHINES = ("drive", "pendulum", "two-mass")
MAP_ENR = (0.5, 1.5, 5.0, 15.0)
MAP_SECONDS = (2.0, 5.0, 15.0)
MAP_DRAWS = {"small": 0, "medium": 4, "full": 34}


def suite(size: str) -> list[Wish]:
    """The cases of a size, in an order in which a run that is cut short has some of every family and machine."""
    counts = COUNTS[size]
    wishes = [
        Wish(family, machine, k, SEED)
        for k in range(max(counts.values()))
        for family in FAMILIES
        if k < counts[family]
        for machine in MACHINES
    ]
    return wishes + [
        Wish("S", machine, k, SEED + 1, enr=enr, seconds=seconds)
        for k in range(MAP_DRAWS[size])
        for machine in MAP_MACHINES
        for enr in MAP_ENR
        for seconds in MAP_SECONDS
    ]
