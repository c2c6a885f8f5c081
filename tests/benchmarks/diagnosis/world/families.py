"""Cases that look like the world: other scales, discrepancy, closed loops, dirt, single records, wrong units.

Each begins as a case with one effect by the separate simulator (`truth`), and what the world does to it is done on top.
"""

import math
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Context
from tests.benchmarks.diagnosis.truth.families import Drawn, Wish, draw_case
from tests.benchmarks.diagnosis.truth.library import EFFECTS
from tests.benchmarks.diagnosis.truth.run import Injection, run_trial
from tests.benchmarks.diagnosis.truth.size import sized_to
from tests.benchmarks.diagnosis.truth.write import write_case
from tests.benchmarks.diagnosis.truth.yardstick import Yardstick
from tests.benchmarks.diagnosis.world.dirt import DIRT, WRONG, make_dirty, make_wrong
from tests.benchmarks.diagnosis.world.files import edit_toml, trials_of, without_section
from tests.benchmarks.diagnosis.world.loop import close_loop
from tests.benchmarks.diagnosis.world.scale import MACHINES_WITH_IMAGES, SCALES, scale_case

_EVERY = ("pendulum", "drive", "two-mass", "cart", "double-pendulum", "tanks")
# Machines of each family; single records are of plants that integrate (drive, cart) or fall over (pendulum).
WORLD = {
    "scale": MACHINES_WITH_IMAGES,
    "discrepancy": _EVERY,
    "loop": ("drive",),
    "dirt": _EVERY,
    "single": ("drive", "cart", "pendulum"),
    "units": _EVERY,
}
TITLES = {
    "scale": "the same plants from milli to kilo scale",
    "discrepancy": "parameters 1 to 3 % off, undeclared, and one or two small effects of no interest",
    "loop": "closed loop",
    "dirt": "filtered, coarse, jittering, with gaps, or with clocks that do not agree",
    "single": "one record of a plant that integrates or falls",
    "units": "a column in another unit than declared",
}
ENR = 30.0
OFF, SMALL = (0.01, 0.03), (0.1, 0.3)
MECHANICAL = ("viscous_friction", "coulomb_friction", "quadratic_drag", "cogging", "passive_stiffness")


@dataclass(frozen=True)
class WorldWish:
    """What is asked of a case; its trials last `seconds` (times the machine's slowness)."""

    family: str
    machine: str
    index: int
    seed: int
    seconds: float = 10.0

    @property
    def name(self) -> str:
        """Name of the case, unique within a run of one seed."""
        return f"{self.family}_{self.machine}_{self.index:03d}"


def make_case(wish: WorldWish, folder: Path) -> dict[str, Any]:
    """Write a case and return its answer, in the form of the other families'; `wrong` says what a data check must find.

    Raises:
        TruthError: if the true machine leaves all bounds.
    """
    random = np.random.default_rng([wish.seed, wish.index, zlib.crc32(wish.name.encode())])
    drawn = _drawn(wish, random)
    answer = write_case(drawn, folder)
    main = drawn.injections[0]
    answer |= {"family": wish.family, "effects": [main.id], "sites": [main.site], "wrong": "", "kind": ""}
    answer["parameters"] = answer["parameters"][:1]
    if wish.family == "discrepancy":
        edit_toml(folder, lambda text: without_section(text, "tolerances"))
    elif wish.family == "scale":
        scale = tuple(SCALES)[wish.index % len(SCALES)]
        answer |= {"model": scale_case(folder, drawn.machine, scale), "kind": scale, "parameters": []}
    elif wish.family == "dirt":
        kinds = [kind for kind in DIRT if drawn.machine.inputs or kind not in WRONG]
        kind = kinds[wish.index % len(kinds)]
        make_dirty(folder, drawn.machine, kind, random)
        answer |= {"kind": kind, "wrong": WRONG.get(kind, "")}
    elif wish.family == "single":
        _as_one_record(folder)
    elif wish.family == "units":
        column, factor = make_wrong(folder, drawn.machine, random)
        answer |= {"kind": f"{column} x {factor:.4g}", "wrong": "unit"}
    return answer


def _drawn(wish: WorldWish, random: np.random.Generator) -> Drawn:
    effects: tuple[str, ...] = ()
    if wish.family == "loop":
        offered = [name for name in MECHANICAL if name in EFFECTS[wish.machine]]
        effects = (offered[wish.index % len(offered)],)
    seconds = 3 * wish.seconds if wish.family == "single" else wish.seconds
    drawn = draw_case(Wish("S", wish.machine, wish.index, wish.seed, enr=ENR, seconds=seconds, effects=effects))
    if wish.family == "discrepancy":
        drawn = _with_discrepancy(drawn, random)
    elif wish.family == "loop":
        drawn = close_loop(drawn, random)
    elif wish.family == "single" and wish.machine == "pendulum":
        first = drawn.plans[0]
        drawn = replace(drawn, plans=(replace(first, q0=np.array([0.05]), v0=np.zeros(1)), *drawn.plans[1:]))
    return drawn


def _with_discrepancy(drawn: Drawn, random: np.random.Generator) -> Drawn:
    """The case with parameters that nobody knows to be off, and small effects of no interest beside the main one."""
    machine = drawn.machine
    runs = tuple(run_trial(machine, plan) for plan in drawn.plans)
    yardstick = Yardstick.of(machine, drawn.plans, list(runs), drawn.recorder, random)
    context, small = Context(machine, random, runs), list[Injection]()
    names = [name for name in sorted(EFFECTS[machine.name]) if name != drawn.injections[0].id]
    for name in random.choice(names, int(random.integers(1, 3)), replace=False):
        found, _ = sized_to(EFFECTS[machine.name][str(name)](context), ENR * random.uniform(*SMALL), yardstick)
        taken = {key for each in (*drawn.injections, *small) for key in each.values}
        if not taken & found.values.keys():
            small.append(found)
    changed = {
        name: machine.values[name] * (1 + float(random.choice([-1, 1])) * random.uniform(*OFF))
        for name in sorted(machine.tolerances)
    }
    return replace(drawn, injections=(*drawn.injections, *small), changed=changed)


def _as_one_record(folder: Path) -> None:
    """Leave the first trial alone, its first two thirds for learning."""
    first, *others = trials_of(folder)
    for file in others:
        file.unlink()
    last = float(first.read_text().rstrip().rsplit("\n", 1)[1].split(",")[0])
    split = math.floor(2 * last / 3)

    def one(text: str) -> str:
        kept = [line for line in text.splitlines() if not line.startswith(("files", "learning", "held_out"))]
        windows = [f'files = ["{first.name}"]', f"learning_window_s = [0.0, {split}]"]
        return "\n".join([*windows, f"held_out_window_s = [{split}, {last:.6g}]", *kept]) + "\n"

    edit_toml(folder, one)
