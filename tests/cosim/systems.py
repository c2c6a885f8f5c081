"""Systems of the small FMUs, for tests of masters, engine and simulation."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from small_fmus import small_fmu

from orchestrator.cosim import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.simulation import Simulation
from orchestrator.results.recorder import MemoryRecorder
from orchestrator.results.result import Result

# x(10 s) of a mass of 1 kg on a spring of 10 N/m, from rest at 1 m
PAIR_EXACT = float(np.cos(10.0 * np.sqrt(10.0)))


def spec(name: str, model: str, version: int = 2, **values: Any) -> ComponentSpec:
    """A component of a small FMU, run by co-simulation."""
    given = {key: Value(value) for key, value in values.items()}
    return ComponentSpec(
        name, source=str(small_fmu(model, version)), values=given, options={"interface": "CoSimulation"}
    )


def system(specs: Sequence[ComponentSpec], connections: Sequence[tuple[str, str]], **run: Any) -> System:
    """A system of components and connections."""
    return System(
        "test",
        {each.name: each for each in specs},
        tuple(Connection(source, target) for source, target in connections),
        run=RunSettings(**run),
        folder=Path("/"),
    )


def pair(version: int = 2, step: float = 1e-3, **run: Any) -> System:
    """The mass on a spring of the benchmark."""
    return system(
        [spec("mass", "mass", version), spec("spring", "spring", version)],
        [("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.f2", "mass.fa")],
        step=step,
        **run,
    )


def chain(version: int = 2, count: int = 4, step: float = 1e-3, **run: Any) -> System:
    """Masses in a row, each on a spring to the one before; the first spring hangs on a wall."""
    specs, connections = [], []
    for k in range(count):
        specs += [spec(f"mass{k}", "mass", version), spec(f"spring{k}", "spring", version, d=0.1)]
        connections += [
            (f"mass{k}.x", f"spring{k}.x2"),
            (f"mass{k}.v", f"spring{k}.v2"),
            (f"spring{k}.f2", f"mass{k}.fa"),
        ]
        if k > 0:
            connections += [(f"mass{k - 1}.x", f"spring{k}.x1"), (f"mass{k - 1}.v", f"spring{k}.v1")]
            connections.append((f"spring{k}.f1", f"mass{k - 1}.fb"))
    return system(specs, connections, step=step, **run)


def ring(*gains: Mapping[str, float], version: int = 2, **run: Any) -> System:
    """Gains in a circle, each driven by the one before."""
    specs = [spec(f"g{k}", "gain", version, **gain) for k, gain in enumerate(gains)]
    connections = [(f"g{k - 1}.y" if k else f"g{len(gains) - 1}.y", f"g{k}.u") for k in range(len(gains))]
    return system(specs, connections, step=0.1, **run)


def recorded(what: System, until: float, **options: Any) -> Result:
    """Run a system and give all outputs."""
    recorder = MemoryRecorder()
    with Simulation(what, **options) as simulation:
        simulation.run(until, recorder)
    return recorder.result()
